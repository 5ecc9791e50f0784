#include "formats/gltf/value.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/scene/limits.h"

namespace ls::scene::gltf {
namespace {

// An input iterator over the JSON text. In *reached it stores the position up to which the parser has read.
class Reading {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  Reading(const char* at, const char** reached) : at_(at), reached_(reached) {}
  reference operator*() const { return *at_; }
  Reading& operator++() {
    *reached_ = ++at_;
    return *this;
  }
  bool operator==(const Reading& other) const { return at_ == other.at_; }
  bool operator!=(const Reading& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  const char** reached_;
};

// Builds the tree from the events of nlohmann's parser, and stops the parser at the limits of limits.h.
class Builder {
 public:
  Builder(const char* begin, const char* const* reached) : begin_(begin), reached_(reached) {}

  bool null() { return add(4, std::monostate{}); }
  bool boolean(bool x) { return add(4, x); }
  bool number_integer(std::int64_t x) { return add(2, static_cast<double>(x)); }
  bool number_unsigned(std::uint64_t x) { return add(2, static_cast<double>(x)); }
  bool number_float(double x, const std::string& text) { return add(text.size() + 1, x); }
  bool string(std::string& x) { return add(x.size() + 2, std::move(x)); }
  bool binary(nlohmann::json::binary_t&) { return false; }
  bool start_object(std::size_t) { return open(Value::Members{}); }
  bool start_array(std::size_t) { return open(Value::List{}); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }
  bool key(std::string& name) {
    open_.back().name = std::move(name);
    open_.back().named_at = before(open_.back().name.size() + 2);
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception&) {
    wrong_ = "from here on this is not JSON";
    return false;
  }

  Value take() { return std::move(root_); }
  const std::string& wrong() const { return wrong_; }

 private:
  struct Open {
    Value value;
    std::string name;  // name of the member whose value is parsed next
    std::size_t named_at = 0;
  };

  std::size_t before(std::size_t length) const {
    const auto read = static_cast<std::size_t>(*reached_ - begin_);
    return read - std::min(read, length);
  }
  template <class T>
  bool add(std::size_t length, T&& is) {
    return place(Value{before(length), std::forward<T>(is)});
  }
  template <class T>
  bool open(T&& is) {
    if (open_.size() >= static_cast<std::size_t>(kMaxNesting))
      return stop(fmt::format("values are nested more than {} deep", kMaxNesting));
    std::size_t offset = before(1);
    if (!open_.empty() && std::holds_alternative<Value::Members>(open_.back().value.is))
      offset = open_.back().named_at;
    open_.push_back({Value{offset, std::forward<T>(is)}, {}, 0});
    return true;
  }
  bool close() {
    Value done = std::move(open_.back().value);
    open_.pop_back();
    if (auto* members = std::get_if<Value::Members>(&done.is))
      std::stable_sort(members->begin(), members->end(),
                       [](const Member& a, const Member& b) { return a.name < b.name; });
    return place(std::move(done));
  }
  bool place(Value value) {
    if (++count_ > kMaxGltfValues) return stop(fmt::format("more than {} values", kMaxGltfValues));
    if (open_.empty()) {
      root_ = std::move(value);
      return true;
    }
    Open& outer = open_.back();
    if (auto* list = std::get_if<Value::List>(&outer.value.is)) {
      list->push_back(std::move(value));
    } else {
      value.offset = outer.named_at;
      std::get<Value::Members>(outer.value.is).push_back({std::move(outer.name), std::move(value)});
    }
    return true;
  }
  bool stop(std::string why) {
    wrong_ = std::move(why);
    return false;
  }

  const char* begin_;
  const char* const* reached_;
  Value root_;
  std::vector<Open> open_;
  std::size_t count_ = 0;
  std::string wrong_;
};

// Returns the last of the values that begin at or before `offset`; nullptr: there is none.
const Value* last_before(const Value::List& list, std::size_t offset) {
  const auto after = std::upper_bound(list.begin(), list.end(), offset,
                                      [](std::size_t x, const Value& one) { return x < one.offset; });
  return after == list.begin() ? nullptr : &*(after - 1);
}
const Member* last_before(const Value::Members& members, std::size_t offset) {
  const Member* last = nullptr;
  for (const Member& one : members)
    if (one.value.offset <= offset && (!last || one.value.offset > last->value.offset)) last = &one;
  return last;
}

}  // namespace

std::string path_at(const Value& root, std::size_t offset) {
  std::string path;
  const Value* at = &root;
  while (at) {
    const Value* next = nullptr;
    if (const auto* list = std::get_if<Value::List>(&at->is)) {
      next = last_before(*list, offset);
      if (next) path += fmt::format("[{}]", next - list->data());
    } else if (const auto* members = std::get_if<Value::Members>(&at->is)) {
      const Member* m = last_before(*members, offset);
      if (m) path += fmt::format("{}{}", path.empty() ? "" : ".", m->name);
      next = m ? &m->value : nullptr;
    }
    at = next;
  }
  return path;
}

std::shared_ptr<const Value> parse_json(std::string name, std::string text, Report& report) {
  const char* reached = text.data();
  Builder builder(text.data(), &reached);
  const char* const end = text.data() + text.size();
  const bool done =
      nlohmann::json::sax_parse(Reading(text.data(), &reached), Reading(end, &reached), &builder);
  const std::size_t length = static_cast<std::size_t>(reached - text.data());
  if (!done) {
    const std::uint32_t file = report.add_file(SourceText(std::move(name), std::move(text)));
    report.error({file, length - std::min<std::size_t>(length, 1), 1}, builder.wrong());
    return nullptr;
  }
  const auto root = std::make_shared<const Value>(builder.take());
  report.add_file(
      SourceText(std::move(name), std::move(text), [root](std::size_t at) { return path_at(*root, at); }));
  return root;
}

Item Item::operator[](std::string_view name) const {
  if (!value_) return {nullptr, near_, report_};
  const auto* members = std::get_if<Value::Members>(&value_->is);
  if (!members) return error("an object is wanted here, {...}"), Item{nullptr, near_, report_};
  const auto found = std::lower_bound(members->begin(), members->end(), name,
                                      [](const Member& m, std::string_view x) { return m.name < x; });
  if (found == members->end() || found->name != name) return {nullptr, value_, report_};
  return {&found->value, &found->value, report_};
}

std::vector<Item> Item::list() const {
  std::vector<Item> all;
  if (!value_) return all;
  const auto* list = std::get_if<Value::List>(&value_->is);
  if (!list) return error("a list is wanted here, [...]"), all;
  all.reserve(list->size());
  for (const Value& v : *list) all.push_back(Item(v, *report_));
  return all;
}

template <class T>
T Item::read(T fallback, std::string_view wanted) const {
  if (!value_) return fallback;
  if (const auto* x = std::get_if<T>(&value_->is)) return *x;
  error(fmt::format("{} is wanted here", wanted));
  return fallback;
}

bool Item::is_true(bool fallback) const { return read(fallback, "true or false"); }
double Item::number(double fallback) const { return read(fallback, "a number"); }
std::string Item::text(std::string_view fallback) const { return read(std::string(fallback), "a text"); }

void Item::read_numbers(std::vector<double>& all) const {
  if (!value_) return;
  const auto* list = std::get_if<Value::List>(&value_->is);
  if (!list || list->size() != all.size())
    return error(fmt::format("{} numbers are wanted here", all.size()));
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = Item((*list)[i], *report_).number(all[i]);
}

std::optional<std::size_t> Item::whole(std::size_t least, std::size_t most) const {
  if (!value_) return std::nullopt;
  const auto* x = std::get_if<double>(&value_->is);
  if (x && *x == std::floor(*x) && *x >= static_cast<double>(least) && *x <= static_cast<double>(most))
    return static_cast<std::size_t>(*x);
  return refuse(fmt::format("a whole number from {} to {} is wanted here", least, most));
}

Item Item::in(const Item& all) const {
  const Item none(nullptr, near_, report_);
  if (!value_) return none;
  const auto* list = all.value_ ? std::get_if<Value::List>(&all.value_->is) : nullptr;
  const std::size_t count = list ? list->size() : 0;
  if (count == 0)
    return error("there is nothing that this index could mean: the file has no such list"), none;
  const auto index = whole(0, count - 1);
  return index ? Item((*list)[*index], *report_) : none;
}

}  // namespace ls::scene::gltf
