#include <nlohmann/json.hpp>
#include <stdexcept>

#include "cli/local/local_farm.h"
#include "core/image/exr/exr_file.h"
#include "tests/coverage/job.h"

namespace ls::test {
namespace {

using nlohmann::json;

template <class T>
T checked(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

ImageError error_of(const json& report) {
  ImageError e;
  e.rmse = report.at("rmse");
  e.relmse = report.at("relmse");
  if (const json& ends = report.at("rmse_ci95"); !ends.is_null())
    e.rmse_lo = ends.at(0), e.rmse_hi = ends.at(1);
  if (const json& ends = report.at("relmse_ci95"); !ends.is_null())
    e.relmse_lo = ends.at(0), e.relmse_hi = ends.at(1);
  e.spp = report.at("spp");
  e.trusted = report.at("trusted");
  return e;
}

CoverageJob run(const CoverageScene& scene, JobSpec spec) {
  const auto farm = checked(cli::LocalFarm::open({1, false}));
  cli::LocalScene local;
  local.name = scene.name;
  local.text = scene.xml;
  const auto id = farm->submit(local, spec);
  if (!id) throw std::runtime_error(id.error().error.message);
  if (const auto started = farm->start({}); !started) throw std::runtime_error(started.error().message);
  (void)farm->coordinator().wait(*id);
  farm->stop();
  const json report = json::parse(checked(farm->coordinator().report_json(*id)));
  const auto picture = checked(read_exr_rgb(checked(farm->coordinator().image_exr(*id)), scene.name));
  return {
      {picture.rgb.begin(), picture.rgb.end()}, error_of(report), report.at("verdict_kind") == "heavy_tail"};
}

JobSpec spec_with(std::uint64_t spp, std::uint64_t seed) {
  JobSpec spec;
  spec.size = FrameSize{64, 64};
  spec.seed = seed;
  spec.spp = spp;
  spec.float_output = true;
  return spec;
}

}  // namespace

CoverageJob run_adaptive_job(const CoverageScene& scene, std::uint64_t seed) {
  JobSpec spec = spec_with(scene.spp, seed);
  spec.target_error = scene.target;
  return run(scene, spec);
}

CoverageJob run_uniform_job(const CoverageScene& scene, std::uint64_t spp, std::uint64_t seed) {
  return run(scene, spec_with(spp, seed));
}

}  // namespace ls::test
