#include "coordinator/webhooks/webhook_outbox.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "coordinator/store/files.h"
#include "core/base/digest.h"

namespace ls::coordinator::webhooks {

double retry_seconds(int attempts) {
  return std::min(kFirstRetrySeconds * std::exp2(std::clamp(attempts - 1, 0, 30)), kMaxRetrySeconds);
}

std::optional<Delivery> Line::add(Delivery delivery) {
  std::optional<Delivery> given_up;
  if (waiting_.size() >= kMaxWaiting) given_up = pop();
  waiting_.push_back(std::move(delivery));
  return given_up;
}

const Delivery* Line::due(TimePoint now) const {
  return waiting_.empty() || now < not_before_ ? nullptr : &waiting_.front();
}

std::optional<TimePoint> Line::next_due() const {
  return waiting_.empty() ? std::nullopt : std::optional(not_before_);
}

std::optional<Delivery> Line::taken() {
  if (waiting_.empty()) return std::nullopt;
  return pop();
}

std::optional<Delivery> Line::failed(TimePoint now) {
  if (waiting_.empty()) return std::nullopt;
  if (++attempts_ >= kMaxAttempts) return pop();
  not_before_ = now + from_seconds(retry_seconds(attempts_));
  return std::nullopt;
}

Delivery Line::pop() {
  Delivery first = std::move(waiting_.front());
  waiting_.pop_front();
  attempts_ = 0;
  not_before_ = TimePoint{};
  return first;
}

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t kMaxDeliveryBytes = 4 << 20;

std::optional<Delivery> read_delivery(const fs::path& file) {
  const auto bytes = read_file(file, kMaxDeliveryBytes);
  if (!bytes) return std::nullopt;
  const auto* text = reinterpret_cast<const char*>(bytes->data());
  const json j = json::parse(text, text + bytes->size(), nullptr, false);
  const auto is_text = [&](const char* key) { return j.contains(key) && j[key].is_string(); };
  if (!j.is_object() || !is_text("id") || !is_text("event") || !is_text("body") || !j.contains("number") ||
      !j["number"].is_number_unsigned())
    return std::nullopt;
  return Delivery{j["number"].get<std::uint64_t>(), j["id"].get<std::string>(), j["event"].get<std::string>(),
                  j["body"].get<std::string>()};
}

std::vector<fs::path> files_of(const fs::path& folder) {
  return list_folder(folder).value_or(std::vector<fs::path>());
}

}  // namespace

Result<Outbox> Outbox::open(fs::path folder, const std::vector<std::string>& urls) {
  Outbox outbox(std::move(folder));
  if (auto made = make_folder(outbox.folder_ / "open"); !made) return tl::unexpected(made.error());
  for (const auto& url : urls) {
    outbox.receivers_.push_back(outbox.folder_ / sha256(url).hex().substr(0, 16));
    if (auto made = make_folder(outbox.receivers_.back()); !made) return tl::unexpected(made.error());
  }
  return outbox;
}

fs::path Outbox::file(std::size_t receiver, const Delivery& delivery) const {
  return receivers_[receiver] / fmt::format("{}.json", delivery.number);
}

std::vector<Delivery> Outbox::waiting(std::size_t receiver) const {
  std::vector<Delivery> found;
  for (const fs::path& path : files_of(receivers_[receiver]))
    if (auto delivery = path.extension() == ".json" ? read_delivery(path) : std::nullopt)
      found.push_back(std::move(*delivery));
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
  return found;
}

Result<void> Outbox::keep(std::size_t receiver, const Delivery& d) {
  const std::string text =
      json{{"number", d.number}, {"id", d.id}, {"event", d.event}, {"body", d.body}}.dump(
          -1, ' ', false, json::error_handler_t::replace);
  return write_atomically(file(receiver, d), std::as_bytes(std::span(text)));
}

void Outbox::forget(std::size_t receiver, const Delivery& delivery) {
  std::error_code gone_already;
  fs::remove(file(receiver, delivery), gone_already);
}

std::set<JobId> Outbox::open_jobs() const {
  std::set<JobId> jobs;
  for (const fs::path& path : files_of(folder_ / "open")) jobs.insert(JobId{path.filename().string()});
  return jobs;
}

Result<void> Outbox::job_is_open(const JobId& job) {
  return write_atomically(folder_ / "open" / job.value, {});
}

void Outbox::job_has_ended(const JobId& job) {
  std::error_code gone_already;
  fs::remove(folder_ / "open" / job.value, gone_already);
}

}  // namespace ls::coordinator::webhooks
