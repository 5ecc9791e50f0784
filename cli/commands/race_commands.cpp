// The parts of races that `lightshaft compare` (python/src/lightshaft_command/race) leaves to this program:
// `race-lane` renders, and `race-tool` measures pictures, forecasts and draws. Both read lines of JSON from
// standard input and answer each by a line; they are not shown in the help.
#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/commands/commands.h"
#include "cli/local/local_scene.h"
#include "cli/local/local_world.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "compare/picture.h"
#include "compare/racer.h"
#include "core/image/error/convergence.h"
#include "core/job/limits.h"
#include "core/scene/schema/integrators.h"
#include "util/report/html.h"
#include "util/report/log_plot.h"
#include "worker/render/render.h"

namespace ls::cli {
namespace {

using nlohmann::json;

void answer(const json& reply) {
  print(reply.dump(-1, ' ', false, json::error_handler_t::replace));  // what is not finite becomes null
}

double number_or_nan(const json& j) { return j.is_number() ? j.get<double>() : NAN; }

// ---- race-lane ----

struct LaneFlags {
  std::string scene, integrator, time, clock, spp, seed, threads, size, folder, name;
  std::vector<std::string> defines;
  bool strict = false;
};

json state_of(const race::Racer& racer) {
  const race::Turn turn = racer.next();
  return {{"done", turn.done}, {"used", turn.used}, {"expected", turn.expected}};
}

json results_of(const race::Racer& racer) {
  json points = json::array(), halves = json::array();
  for (const race::Checkpoint& c : racer.checkpoints())
    points.push_back({{"spp", c.spp},
                      {"wall", c.cost.wall},
                      {"cpu", c.cost.cpu},
                      {"last", c.last},
                      {"estimate", {c.estimate.relmse, c.estimate.relmse_lo, c.estimate.relmse_hi}},
                      {"picture", c.picture.string()}});
  for (const auto& file : racer.halves()) halves.push_back(file.string());
  return {{"points", points}, {"halves", halves}, {"notes", racer.notes()}};
}

// Lets the racer render as standard input says: "begin", "turn" as often as it is its turn, and "end".
int serve_lane(race::RenderEntry entry, const race::Conditions& conditions) {
  const std::atomic<bool> stop{false};
  std::unique_ptr<race::Racer> racer;
  for (std::string line; std::getline(std::cin, line);) {
    const json request = json::parse(line, nullptr, false);
    if (!racer) racer = race::make_render_racer(entry, conditions);
    if (request == "turn") {
      if (const auto ok = racer->take_turn(stop); !ok) return print_error(ok.error());
    }
    answer(request == "end" ? results_of(*racer) : state_of(*racer));
  }
  return kOk;
}

int run_lane(const LaneFlags& flags) {
  race::Conditions conditions;
  JobSpec spec;
  std::uint64_t threads = 1;
  auto defines = parse_defines(flags.defines);
  if (!defines) return print_error(defines.error());
  for (const auto& taken :
       {take(flags.time, conditions.time, positive("--time", kMaxSeconds)),
        take(flags.spp, conditions.most_spp, whole("--spp", 2, kMaxSpp)),
        take(flags.seed, spec.seed, whole("--seed", 0, UINT64_MAX)),
        take(flags.threads, threads, whole("--threads", 1, 1024)), take(flags.size, spec.size, parse_size)})
    if (!taken) return print_error(taken.error());
  conditions.clock = flags.clock == "cpu" ? race::RaceClock::cpu : race::RaceClock::wall;
  conditions.threads = static_cast<int>(threads);
  if (!flags.integrator.empty()) spec.integrator = flags.integrator;
  spec.defines = std::move(*defines);
  const auto scene = read_local_scene(flags.scene, spec.defines, flags.strict);
  if (!scene) return print_rejected(scene.error());
  const auto limit = render::limit_threads(conditions.threads);
  const auto world = build_local_world(*scene, spec, conditions.threads);
  if (!world) return print_rejected(world.error());
  const RenderSettings& settings = world->job.settings;
  conditions.size = settings.size;
  // "whole": the integrator renders all features of the scene, so that its pictures can serve as references.
  answer({{"size", {settings.size.width, settings.size.height}},
          {"integrator", settings.integrator},
          {"whole", scene->scene.media.empty() || scene::sees_media(settings.integrator)},
          {"scene", world->job.scene.hex()}});
  return serve_lane({world->world, grid_of(settings), flags.name, flags.folder}, conditions);
}

// ---- race-tool ----

template <class T>
T must(Result<T> result) {
  if (!result) throw std::invalid_argument(result.error().message);
  return std::move(*result);
}

// Computes the weighted mean of pictures.
class Sum {
 public:
  void add(const race::Pixels& pixels, double weight) {
    sums_.resize(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) sums_[i] += weight * static_cast<double>(pixels[i]);
    weights_ += weight;
  }
  race::Pixels mean() const {
    race::Pixels out(sums_.size());
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(sums_[i] / weights_);
    return out;
  }

 private:
  std::vector<double> sums_;
  double weights_ = 0;
};

class Tool {
 public:
  json reply(const json& request) {
    const std::string what = request.at("do");
    if (what == "reference") return read_reference(request);
    if (what == "halves") return average_halves(request);
    if (what == "errors") return measure(request.at("picture"));
    if (what == "forecast") return forecast(request);
    if (what == "plot") return plot(request);
    if (what == "document")
      return {
          {"page", report::document(request.at("title").get<std::string>(),
                                    request.at("css").get<std::string>() + std::string(report::plot_css()),
                                    request.at("body").get<std::string>())}};
    throw std::invalid_argument("nobody can measure or draw " + what);
  }

 private:
  void take_size(const json& request) { size_ = {request.at("size").at(0), request.at("size").at(1)}; }

  json read_reference(const json& request) {
    take_size(request);
    std::vector<race::ReferenceFile> files;
    for (const std::string name : request.at("files")) {
      files.push_back(must(race::read_reference(name, size_)));
      refuse_own_noise(files.back(), request);
    }
    reference_ = race::combine(files);
    return {{"words", race::describe(files)}, {"noise", race::noise_of(reference_)}};
  }

  // Rejects a reference that was rendered from a scene of the race with a seed that races. It would have the
  // same noise as the picture with that seed, whose error would seem much smaller than it is.
  static void refuse_own_noise(const race::ReferenceFile& file, const json& request) {
    for (const std::string scene : request.at("scenes"))
      for (const std::uint64_t seed : request.at("seeds"))
        if (const auto digest = Digest::parse(scene);
            digest && same_noise(file.picture.origin, *digest, seed))
          throw std::invalid_argument(
              fmt::format("{} was rendered from this scene with seed {}, which races, too: its noise is the "
                          "same noise; race other seeds (--seed {})",
                          file.name, seed, seed + 1));
  }

  json average_halves(const json& request) {
    take_size(request);
    Sum first, second;
    for (const json& lane : request.at("halves")) {
      first.add(must(race::kept(lane.at(0).get<std::string>(), size_)), lane.at(2));
      second.add(must(race::kept(lane.at(1).get<std::string>(), size_)), lane.at(2));
    }
    reference_ = {first.mean(), second.mean()};
    return {{"noise", race::noise_of(reference_)}};
  }

  json measure(const std::string& picture) const {
    const auto pixels =
        must(picture.ends_with(".exr") ? race::read_picture(picture, size_) : race::kept(picture, size_));
    const race::Wrong wrong = race::wrong(pixels, reference_);
    return {{"mse", wrong.mse}, {"relmse", wrong.relmse}};
  }

  static json forecast(const json& request) {
    std::vector<ErrorPoint> points;
    for (const json& p : request.at("points"))
      points.push_back({number_or_nan(p.at(0)), number_or_nan(p.at(1)), number_or_nan(p.at(2)),
                        number_or_nan(p.at(3)), number_or_nan(p.at(4))});
    const auto found = forecast_of(points, number_or_nan(request.at("target")));
    json seconds;
    if (found) seconds = {found->core_seconds, found->core_seconds_lo, found->core_seconds_hi};
    return {{"seconds", std::move(seconds)}};
  }

  static json plot(const json& request) {
    report::LogPlot plot;
    plot.id = request.at("id"), plot.title = request.at("title"), plot.summary = request.at("summary");
    plot.x_title = request.at("x_title"), plot.y_title = request.at("y_title");
    for (const json& curve : request.at("curves")) {
      report::Curve& out = plot.curves.emplace_back();
      out.name = curve.at("name");
      for (const json& p : curve.at("points")) out.points.push_back({p.at(0), p.at(1), p.at(2), p.at(3)});
    }
    return {{"element", report::svg_of(plot)}, {"file", report::standalone_svg(plot)}};
  }

  FrameSize size_;
  race::Reference reference_;
};

struct ToolFlags {};

int run_tool(const ToolFlags&) {
  Tool tool;
  for (std::string line; std::getline(std::cin, line);) {
    try {
      answer(tool.reply(json::parse(line)));
    } catch (const std::exception& e) {
      answer({{"error", e.what()}});
    }
  }
  return kOk;
}

}  // namespace

void add_race(CLI::App& app, Action& action) {
  const auto [lane, flags] =
      add_command<LaneFlags>(app, action, "race-lane", "renders a lane of a race", run_lane);
  lane->group("");
  for (const auto& [name, value] :
       {std::pair{"scene", &flags->scene}, std::pair{"--integrator", &flags->integrator},
        std::pair{"--time", &flags->time}, std::pair{"--clock", &flags->clock},
        std::pair{"--spp", &flags->spp}, std::pair{"--seed", &flags->seed},
        std::pair{"--threads", &flags->threads}, std::pair{"--size", &flags->size},
        std::pair{"--folder", &flags->folder}, std::pair{"--name", &flags->name}})
    lane->add_option(name, *value);
  add_defines(*lane, flags->defines);
  lane->add_flag("--strict", flags->strict);
  add_command<ToolFlags>(app, action, "race-tool", "measures pictures of races", run_tool).first->group("");
}

}  // namespace ls::cli
