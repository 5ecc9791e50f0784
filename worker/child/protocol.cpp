#include "worker/child/protocol.h"

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace ls::worker::child {
std::string to_text(const LocalJob& job) {
  nlohmann::json assets = nlohmann::json::object();
  for (const auto& [digest, path] : job.assets) assets[digest.hex()] = path.string();
  nlohmann::json names = nlohmann::json::array();
  for (const BlobRef& blob : job.brief.assets) names.push_back({blob.digest.hex(), blob.bytes, blob.name});
  const nlohmann::json text = {{"job", job.brief.job.value},
                               {"scene", job.brief.scene.hex()},
                               {"settings", canonical_json(job.brief.settings)},
                               {"needs", job.brief.needs},
                               {"scene_file", job.scene.string()},
                               {"blobs", names},
                               {"files", assets}};
  return text.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Result<LocalJob> from_text(std::string_view text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    const auto digest = [](const nlohmann::json& hex) {
      return Digest::parse(hex.get<std::string>()).value();
    };
    LocalJob job;
    job.brief.job = JobId{json.at("job")};
    job.brief.scene = digest(json.at("scene"));
    auto settings = parse_render_settings(json.at("settings").get<std::string>());
    if (!settings) return tl::unexpected<Error>(settings.error());
    job.brief.settings = std::move(*settings);
    job.brief.settings_digest = digest_of(job.brief.settings);
    job.brief.needs = json.at("needs").get<std::string>();
    job.scene = json.at("scene_file").get<std::string>();
    for (const auto& blob : json.at("blobs")) {
      // The type is checked because nlohmann::json converts every number without an error, even one such as
      // 1e20, which does not fit into an integer.
      if (!blob.at(1).is_number_unsigned()) throw std::invalid_argument("the size of a file is no count");
      job.brief.assets.push_back({digest(blob.at(0)), blob.at(1), blob.at(2)});
    }
    for (const auto& [hex, path] : json.at("files").items())
      job.assets[digest(hex)] = path.get<std::string>();
    return job;
  } catch (const std::exception& e) {
    return fail(Errc::internal, std::string("a job that its own agent wrote cannot be read: ") + e.what());
  }
}

}  // namespace ls::worker::child
