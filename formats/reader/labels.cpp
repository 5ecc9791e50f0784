// Reads names of shapes and materials (for Cryptomatte), and the requested AOVs.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/base/text/suggest.h"
#include "core/base/text/utf8.h"
#include "core/scene/schema/integrators.h"
#include "formats/reader/reader.h"
#include "formats/xml/transform_element.h"

namespace ls::scene {
namespace {

constexpr std::size_t kMaxLabelBytes = 256;  // longer names are truncated

std::string shortened(std::string_view name) {
  std::size_t end = std::min(name.size(), kMaxLabelBytes);
  while (end > 0 && end < name.size() && is_continuation(name[end])) --end;
  return std::string(name.substr(0, end));
}

// Returns a file's name without folder and extension: "Tub" for "meshes/Tub.obj".
std::string stem(std::string_view file) {
  if (const auto slash = file.find_last_of("/\\"); slash != std::string_view::npos)
    file.remove_prefix(slash + 1);
  return std::string(file.substr(0, file.rfind('.')));
}

std::string given_name(const Element& e) {
  if (const auto id = e.get("id"); !id.empty()) return shortened(id);
  for (const Element& child : e.children)
    if (child.tag == "string" && child.get("name") == "filename") return shortened(stem(child.get("value")));
  return {};
}

// Returns a material's name. It is the material's id; or the id of the bsdf within it, if the material only
// wraps one (twosided, bumpmap); or else its type and index.
std::string material_name(const Element& e, std::size_t index) {
  if (const auto id = e.get("id"); !id.empty()) return shortened(id);
  for (const Element& child : e.children)
    if (child.tag == "bsdf" && !child.get("id").empty()) return shortened(child.get("id"));
  return fmt::format("{}_{}", e.get("type"), index);
}

std::string no_channel(std::string_view name, const ChannelRow* row) {
  std::vector<std::string> known;
  for (const ChannelRow& r : channels())
    if (r.mitsuba && !r.ours.empty()) known.emplace_back(r.theirs);
  if (!row) return fmt::format("there is no channel \"{}\"{}", name, suggestion(name, known));
  return fmt::format("the channel \"{}\" can't be written by this version; there are {}{}", name,
                     fmt::join(known, ", "),
                     name == "shape_index" ? "; --aov shape_id writes mattes of the shapes by name" : "");
}

}  // namespace

// Returns the name, or if an earlier object has it, the name with a number appended: the object's index in
// its list, or the next larger number that is free. If `name` is empty, the name is made of the type and the
// index.
std::string Reader::fresh_label(std::string name, std::string_view type, std::size_t index) {
  if (name.empty()) name = fmt::format("{}_{}", type, index);
  if (labels_.insert(name).second) return name;
  std::size_t& number = label_numbers_[name];  // least number to try for this name
  number = std::max(number, index);
  while (true)
    if (auto numbered = fmt::format("{}_{}", name, number++); labels_.insert(numbered).second)
      return numbered;
}

void Reader::label_shape(const Element& e) {
  if (!document_.labels) return;
  const std::size_t index = scene_.shape_labels.size();
  Label label{fresh_label(given_name(e), e.get("type"), index), {}};
  label.material = material_ ? material_name(*material_, scene_.shapes.back().bsdf.value) : "default";
  scene_.shape_labels.push_back(std::move(label));
}

void Reader::label_instance(const Element& e) {
  if (!document_.labels) return;
  scene_.instance_labels.push_back(
      {fresh_label(given_name(e), e.get("type"), scene_.instance_labels.size()), {}});
}

// Reads the integrator's list "label:channel, ...": the AOVs that the scene requests.
void Reader::read_channels(Params& p) {
  const Element* channels = p.take("aovs");
  if (!channels) return;
  const Span at = value_place(*channels, "value");
  std::vector<std::string> renamed;
  std::string_view rest = channels->get("value");
  while (!rest.empty()) {
    const auto end = std::min(rest.find_first_of(", \t\r\n"), rest.size());
    const std::string_view item = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (item.empty()) continue;
    const auto colon = item.find(':');
    if (colon == std::string_view::npos || colon == 0)
      return report_.error(at, fmt::format("\"{}\" of 'aovs' is not written as label:channel", item));
    const std::string_view name = item.substr(colon + 1), label = item.substr(0, colon);
    const ChannelRow* row = channel_row(name);
    if (!row || row->ours.empty()) return report_.error(at, no_channel(name, row));
    const std::string_view ours = row->ours;
    if (label != ours) renamed.push_back(fmt::format("\"{}\" is \"{}\"", label, ours));
    (scene_.aovs += scene_.aovs.empty() ? "" : ",") += ours;
  }
  if (!renamed.empty())
    report_.warning(at, fmt::format("layers have names of their own here: {}", fmt::join(renamed, ", ")));
}

}  // namespace ls::scene
