// The small texts that travel between processes and lie in stores. The first byte says which.
#include "coordinator/assemble/assembly.h"
#include "coordinator/store/jobs/job_store.h"
#include "core/image/film/health.h"
#include "core/image/film/partial.h"
#include "core/job/settings.h"
#include "tests/fuzz/all_targets.h"
#include "worker/child/protocol.h"

namespace ls::fuzz {
namespace {

// What was read, written and read again is the same.
template <class Read, class Write>
void there_and_back(std::string_view text, Read read, Write write) {
  const auto value = read(text);
  if (!value) return;
  const std::string written = write(*value);
  const auto again = read(std::string_view(written));
  must(again.has_value(), "what was written can be read");
  must(write(*again) == written, "what was written reads back as it was");
}
constexpr auto kCanonical = [](const auto& value) { return canonical_json(value); };

}  // namespace

void small_json(Bytes input) {
  if (input.empty()) return;
  const std::string_view text = text_of(input.subspan(1));
  switch (input[0]) {
    case 's':
      return there_and_back(text, parse_render_settings, kCanonical);
    case 'j':
      return there_and_back(text, parse_job_spec, kCanonical);
    case 'h':
      return there_and_back(text, parse_health, kCanonical);
    case 'u':
      return there_and_back(text, parse_unit_header, kCanonical);
    case 'r':
      return there_and_back(text, coordinator::parse_stored_job,
                            [](const coordinator::StoredJob& job) { return to_json(job); });
    case 'b':
      return there_and_back(text, coordinator::HealthTable::load,
                            [](const coordinator::HealthTable& book) { return book.save(); });
    case 'c':
      return there_and_back(text, worker::child::from_text,
                            [](const worker::LocalJob& job) { return worker::child::to_text(job); });
    default:
      return;
  }
}

Seeds small_json_seeds() {
  RenderSettings settings;
  settings.size = {64, 32};
  settings.integrator = "volpath";
  JobSpec spec;
  spec.spp = 64;
  spec.target_error = .001;
  spec.size = FrameSize{64, 32};
  spec.defines = {{"n", "2"}};
  spec.tags = {"big"};
  spec.frames = FrameRange{1, 9, 2};
  Health health;
  health.add(HealthCause::infinite, 3, {4, 5, 6});
  coordinator::HealthTable book;
  book.folded(0, 0, {0, 2}, health);
  book.folded(3, 2, {4, 6}, health);
  coordinator::StoredJob job;
  job.id.value = "j-1";
  job.name = "a.xml";
  job.settings = settings;
  job.spec = spec;
  job.assets = {{sha256("grid"), 4, "grid.vol"}};
  job.totals.health = health;
  worker::LocalJob local;
  local.brief.job.value = "j-1";
  local.brief.settings = settings;
  local.brief.settings_digest = digest_of(settings);
  local.brief.assets = job.assets;
  local.scene = "scene.json";
  local.assets = {{sha256("grid"), "grid.vol"}};
  UnitHeader header{sha256("s"), sha256("t"), sha256("c"), {0, 0, 32, 32}, {0, 2}};
  return {"s" + canonical_json(settings),
          "j" + canonical_json(spec),
          "h" + canonical_json(health),
          "u" + canonical_json(header),
          "r" + to_json(job),
          "b" + book.save(),
          "c" + worker::child::to_text(local),
          "j{\"spp\":1,\"size\":\"3x4\"}"};
}

}  // namespace ls::fuzz
