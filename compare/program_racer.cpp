#include "compare/program_racer.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "compare/picture.h"
#include "compare/program.h"

namespace ls::race {
namespace {

constexpr std::uintmax_t kMostTextBytes = 1 << 20;
constexpr double kExtraTime = 4;  // multiple of the race's time, in addition to the adapter's most_seconds
constexpr const char* kList = "pictures.jsonl";

Result<std::string> read_text(const std::filesystem::path& file) {
  std::error_code none;
  const auto bytes = std::filesystem::file_size(file, none);
  if (none || !std::filesystem::is_regular_file(file, none))
    return fail(Errc::invalid_argument, fmt::format("it has not written {}", file.filename().string()));
  if (bytes > kMostTextBytes)
    return fail(Errc::invalid_argument, fmt::format("{} has more than 1 MiB", file.filename().string()));
  std::ifstream in(file, std::ios::binary);
  return std::string{std::istreambuf_iterator<char>(in), {}};
}

class ProgramRacer final : public Racer {
 public:
  ProgramRacer(ProgramEntry entry, const Conditions& conditions, const Clock& clock)
      : entry_(std::move(entry)), conditions_(conditions), clock_(clock) {
    if (!entry_.adapter.lists) plan();
  }

  Turn next() const override {
    if (entry_.adapter.lists) return {done_, 0, conditions_.time};
    return {done_, 0, run_.expected};
  }

  Result<void> take_turn(const std::atomic<bool>& stop) override {
    auto ok = entry_.adapter.lists ? take_all(stop) : take_one(stop);
    if (!ok) {
      done_ = true;
      return fail(ok.error().code, fmt::format("{}: {}", entry_.adapter.name, ok.error().message));
    }
    if (done_) points_.back().last = true;
    return {};
  }

  std::vector<Checkpoint> checkpoints() const override { return points_; }

 private:
  std::filesystem::path file(const std::string& what) const {
    return entry_.folder / fmt::format("{}.{}", entry_.name, what);
  }

  Result<Cost> run(std::map<std::string, std::string> values, const std::atomic<bool>& stop) const {
    const auto [width, height] = conditions_.size;
    values.merge(std::map<std::string, std::string>{{"scene", entry_.scene.string()},
                                                    {"seed", std::to_string(entry_.seed)},
                                                    {"size", fmt::format("{}x{}", width, height)},
                                                    {"width", std::to_string(width)},
                                                    {"height", std::to_string(height)},
                                                    {"threads", std::to_string(conditions_.threads)},
                                                    {"adapter", entry_.adapter.folder.string()},
                                                    {"times", file("times").string()},
                                                    {"clock", to_string(conditions_.clock)},
                                                    {"spp", ""},
                                                    {"time", fmt::format("{:g}", conditions_.time)},
                                                    {"image", ""},
                                                    {"folder", entry_.folder.string()}});
    return run_program(
        {filled(entry_.adapter, values), entry_.adapter.most_seconds + kExtraTime * conditions_.time}, clock_,
        stop);
  }

  Result<void> take_part(const std::filesystem::path& exr, double spp, const Cost& cost) {
    const auto pixels = read_picture(exr, conditions_.size);
    std::error_code left;
    std::filesystem::remove(exr, left);
    if (!pixels) return tl::unexpected(pixels.error());
    Checkpoint point{spp, cost, false, {}, file(fmt::format("{}", points_.size()))};
    if (auto kept = keep(point.picture, *pixels); !kept) return kept;
    points_.push_back(std::move(point));
    return {};
  }

  Result<void> take_all(const std::atomic<bool>& stop) {
    done_ = true;
    const std::filesystem::path folder = file("made");
    std::error_code none;
    std::filesystem::create_directory(folder, none);
    const auto cost = run({{"folder", folder.string()}}, stop);
    if (!cost) return tl::unexpected(cost.error());
    const auto text = read_text(folder / kList);
    if (!text) return tl::unexpected(text.error());
    const auto list = parse_pictures(*text);
    if (!list) return fail(list.error().code, fmt::format("{}: {}", kList, list.error().message));
    for (const MadePicture& made : *list) {
      const auto plausible = plausible_cost(made, *cost, conditions_.clock);
      if (!plausible) return tl::unexpected(plausible.error());
      if (auto ok = take_part(folder / made.image, made.spp, *plausible); !ok) return ok;
    }
    std::filesystem::remove_all(folder, none);
    return {};
  }

  Result<void> take_one(const std::atomic<bool>& stop) {
    const std::filesystem::path image = file("exr");
    std::error_code left;
    std::filesystem::remove(file("times"), left);
    auto cost = run({{"spp", std::to_string(run_.spp)}, {"image", image.string()}}, stop);
    if (!cost) return tl::unexpected(cost.error());
    if (std::filesystem::exists(file("times"), left)) {
      const auto text = read_text(file("times"));
      const auto claim = text ? parse_times(*text) : tl::unexpected(text.error());
      if (!claim)
        return fail(claim.error().code, fmt::format("its file of times: {}", claim.error().message));
      cost = plausible_cost(*claim, *cost, conditions_.clock);
      if (!cost) return tl::unexpected(cost.error());
    }
    if (auto ok = take_part(image, static_cast<double>(run_.spp), *cost); !ok) return ok;
    past_.push_back({run_.spp, conditions_.seconds(*cost)});
    plan();
    return {};
  }

  void plan() {
    const auto next = next_run(past_, entry_.adapter.first_spp, conditions_.time, conditions_.most_spp);
    done_ = !next;
    if (next) run_ = *next;
  }

  const ProgramEntry entry_;
  const Conditions conditions_;
  const Clock& clock_;
  bool done_ = false;
  std::vector<Checkpoint> points_;
  NextRun run_;                // with {spp}: the next run
  std::vector<PastRun> past_;  // finished runs
};

}  // namespace

std::unique_ptr<Racer> make_program_racer(ProgramEntry entry, const Conditions& conditions,
                                          const Clock& clock) {
  return std::make_unique<ProgramRacer>(std::move(entry), conditions, clock);
}

}  // namespace ls::race
