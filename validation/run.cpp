#include "validation/run.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>

#include "core/base/clock.h"
#include "core/base/overloaded.h"
#include "validation/fixtures/checks.h"
#include "validation/measure/hypothesis_tests.h"
#include "validation/measure/measure.h"

namespace ls::cases {
namespace {

using cli::Measured;
using cli::ValidateCase;

// Number of paths of the pilot run, which is not judged: it determines how many paths the case needs.
constexpr std::uint64_t kPilotPaths = 1 << 13;
// The number of paths is planned so that the end of the confidence interval stays kSpare standard errors away
// from the end of the band. In about one attempt of seven this margin is too small, by chance or because the
// previous run underestimated the variance. Then the case is repeated with kAgain to kMostAgain times as many
// paths, depending on the newer estimate.
constexpr double kSpare = 1.5, kAgain = 2, kMostAgain = 16;
// The degrees of freedom that the standard error is assumed to have when the number of paths is planned.
constexpr double kPlannedFreedom = 1e3;
// Two one-sided tests, each at the level kWrongPass / kAttempts, decide whether the figure lies in the band.
// They pass if a two-sided confidence interval of this level lies inside the band.
constexpr double kBandLevel = 2 * kWrongPass / kAttempts;

// FNV-1a hash of the case's id, the seed and the attempt: a case's random numbers do not depend on its
// neighbours in the table.
std::uint64_t seed_of(const std::string& id, std::uint64_t seed, std::uint64_t attempt) {
  std::uint64_t h = 0xcbf29ce484222325ull;
  const auto eat = [&h](std::uint64_t byte) { h = (h ^ byte) * 0x100000001b3ull; };
  for (const char c : id) eat(static_cast<unsigned char>(c));
  for (int i = 0; i < 8; ++i) eat((seed >> (8 * i)) & 255);
  eat(attempt);
  return h;
}

std::size_t lines_of(const Case& c) { return c.options.channels ? 3 : 1; }

class Runner {
 public:
  Runner(const RunOptions& options, double level) : options_(options), level_(level) {}

  void run(const Case& c) {
    case_ = &c;
    std::visit(overloaded{[&](const Exact& e) { exact(e); },
                          [&](const Mean& m) {
                            measured([&](std::uint64_t paths, std::uint64_t seed) {
                              return with_expected(m, paths, seed);
                            });
                          },
                          [&](const Same& s) {
                            measured([&](std::uint64_t paths, std::uint64_t seed) {
                              return difference(s, paths, seed);
                            });
                          }},
               c.question);
  }
  std::vector<ValidateCase> take() { return std::move(lines_); }

 private:
  // A measured mean with its expected value, the standard error and its degrees of freedom, in each channel.
  struct Sight {
    Channels expected, got, error, freedom;
    render::Health health;
    std::uint64_t paths = 0;
    double seconds = 0;
  };

  Result<Measured> look(const Maker& make, std::uint64_t paths, std::uint64_t seed) const {
    const SceneBuilder builder = make();
    if (auto lost = what_is_lost(case_->id, builder)) return fail(Errc::internal, *lost);
    if (case_->options.frames > 0)
      return cli::measure_frames(builder.scene, builder.files, paths, seed, options_.threads,
                                 case_->options.frames);
    return cli::measure(builder.scene, builder.files, paths, seed, options_.threads);
  }

  Result<Sight> with_expected(const Mean& mean, std::uint64_t paths, std::uint64_t seed) const {
    const auto m = options_.gain ? broken(mean.expected) : look(mean.scene, paths, seed);
    if (!m) return tl::unexpected(m.error());
    Sight s{mean.expected, {}, {}, {}, m->health, m->paths, m->seconds};
    for (std::size_t k = 0; k < 3; ++k) {
      s.got[k] = case_->options.complement ? 1 - m->mean[k] : m->mean[k];
      s.error[k] = m->standard_error[k];
      s.freedom[k] = m->freedom[k];
    }
    return s;
  }

  Result<Sight> difference(const Same& same, std::uint64_t paths, std::uint64_t seed) const {
    // A simulated broken renderer (RunOptions::gain) has the same error in both scenes, so a case that
    // compares two scenes passes in spite of it. The mean of the scenes is not known without rendering; here
    // it is taken to be 1.
    const auto a = options_.gain ? broken(grey(1)) : look(same.scene, paths, seed),
               b = options_.gain ? a : look(same.other, paths, ~seed);
    if (!a) return tl::unexpected(a.error());
    if (!b) return tl::unexpected(b.error());
    if (a->mean[1] == 0 && b->mean[1] == 0)
      return fail(Errc::internal, "both scenes are black: nothing was compared");
    Sight s{{}, {}, {}, {}, a->health, a->paths + b->paths, a->seconds + b->seconds};
    s.health.merge(b->health);
    for (std::size_t k = 0; k < 3; ++k) {
      const double va = a->standard_error[k] * a->standard_error[k],
                   vb = b->standard_error[k] * b->standard_error[k];
      s.got[k] = a->mean[k];
      s.expected[k] = b->mean[k];
      s.error[k] = std::sqrt(va + vb);
      // The degrees of freedom of the difference, by the formula of Welch and Satterthwaite.
      const double spread = va * va / a->freedom[k] + vb * vb / b->freedom[k];
      s.freedom[k] = spread > 0 ? (va + vb) * (va + vb) / spread : a->freedom[k];
    }
    return s;
  }

  // Returns the figures of a simulated broken renderer, whose values are `gain` times the right ones. Its
  // standard error is `gain` times that of a correct renderer with the planned number of paths (growth()):
  // the end of the confidence interval is then kSpare standard errors away from the end of the band.
  Result<Measured> broken(const Channels& expected) const {
    Measured m;
    m.paths = kPilotPaths;
    for (std::size_t k = 0; k < 3; ++k) {
      const double right = case_->options.complement ? 1 - expected[k] : expected[k];
      const double room = band() * std::abs(expected[k]) - unknown(expected[k]);
      m.mean[k] = *options_.gain * right;
      m.standard_error[k] =
          *options_.gain * room / (kSpare + cli::student_quantile(kBandLevel, kPlannedFreedom));
      m.freedom[k] = kPlannedFreedom;
    }
    return m;
  }

  double band() const { return case_->options.band * (options_.quick ? kQuickWidening : 1); }
  // Returns the part of the half width of a confidence interval that does not depend on the number of paths:
  // float32 rounding, and the uncertainty of the answer.
  double unknown(double expected) const { return (kRounding + case_->options.slack) * std::abs(expected); }

  // Returns the factor by which the number of paths must grow to make the confidence interval fit into the
  // band with kSpare standard errors to spare; 0: no number of paths would suffice.
  double growth(const Sight& s) const {
    double worst = 0;
    for (std::size_t k = 0; k < lines_of(*case_); ++k) {
      const std::size_t c = channel(k);
      const double room = band() * std::abs(s.expected[c]) - unknown(s.expected[c]);
      if (!(room > 0)) return 0;
      const double ratio = s.error[c] * (kSpare + cli::student_quantile(kBandLevel, kPlannedFreedom)) / room;
      worst = std::max(worst, ratio * ratio);
    }
    return worst;
  }

  template <class Look>
  void measured(Look look) {
    const std::string& id = case_->id;
    const double most = options_.quick ? kMostQuickPaths : kMostPaths;
    double times = 1, paths = static_cast<double>(case_->options.paths);
    if (paths == 0) {
      const auto pilot = look(kPilotPaths, seed_of(id, options_.seed, 0));
      if (!pilot) return failed(pilot.error().message);
      times = growth(*pilot);
      paths = std::clamp(static_cast<double>(pilot->paths) * times, double{kPilotPaths}, most);
    }
    for (std::size_t attempt = 1;; ++attempt) {
      const auto s = look(static_cast<std::uint64_t>(paths), seed_of(id, options_.seed, attempt));
      if (!s) return failed(s.error().message);
      std::vector<ValidateCase> lines;
      bool wide = false;
      for (std::size_t k = 0; k < lines_of(*case_); ++k) lines.push_back(judged(*s, k, wide));
      if (wide && times > 0 && attempt < kAttempts && paths < most) {
        paths = std::min(most, std::clamp(growth(*s), kAgain, kMostAgain) * paths);
        continue;
      }
      for (ValidateCase& line : lines) add(std::move(line));
      return;
    }
  }

  std::size_t channel(std::size_t line) const { return case_->options.channels ? line : 1; }

  ValidateCase judged(const Sight& s, std::size_t line, bool& wide) const {
    static const char* const kNames[] = {"/red", "/green", "/blue"};
    const std::size_t k = channel(line);
    ValidateCase c = blank(case_->options.channels ? kNames[line] : "");
    c.kind = "statistical";
    c.expected = s.expected[k];
    c.got = s.got[k];
    c.standard_error = s.error[k];
    c.band = band();
    c.why_band = case_->options.why_band;
    c.level = level_;
    c.band_level = kBandLevel;
    c.nonfinite = cli::samples_gone_wrong(s.health);
    c.paths = s.paths;
    c.seconds = s.seconds / static_cast<double>(lines_of(*case_));
    cli::judge_equivalence(c, s.freedom[k], unknown(c.expected), kRounding * std::abs(c.expected),
                           kLeastFreedom);
    if (c.nonfinite > 0) c.why += ": " + cli::health_text(s.health);
    wide = wide || c.too_wide;
    return c;
  }

  void exact(const Exact& e) {
    const SystemClock clock;
    const TimePoint start = clock.now();
    const Figure f = e.check(
        {seed_of(case_->id, options_.seed, 0), options_.threads, case_->id, options_.gain.value_or(1)});
    ValidateCase c = blank("");
    c.kind = "exact";
    c.expected = f.expected;
    c.got = f.got;
    c.band = f.tolerance;
    c.nonfinite = f.unhealthy;
    c.seconds = seconds(clock.now() - start);
    c.why = f.why;
    if (c.why.empty() && f.unhealthy > 0) c.why = fmt::format("{} samples went wrong", f.unhealthy);
    if (c.why.empty() && !(std::abs(f.got - f.expected) <= f.tolerance))
      c.why = fmt::format("off by {:.3g}, allowed is {:.3g}", std::abs(f.got - f.expected), f.tolerance);
    add(std::move(c));
  }

  void failed(const std::string& why) {
    ValidateCase c = blank("");
    c.kind = "statistical";
    c.why = why;
    add(std::move(c));
  }

  ValidateCase blank(const char* suffix) const {
    ValidateCase c;
    c.name = case_->id + suffix;
    c.rows = case_->rows;
    c.about = case_->about;
    return c;
  }
  void add(ValidateCase c) {
    if (options_.done) options_.done(c);
    lines_.push_back(std::move(c));
  }

  const RunOptions& options_;
  double level_;
  const Case* case_ = nullptr;
  std::vector<ValidateCase> lines_;
};

}  // namespace

double level_of(const Table& table) {
  std::size_t intervals = 0;
  for (const Case& c : table.cases())
    intervals += std::holds_alternative<Exact>(c.question) ? 0 : lines_of(c);
  return cli::sidak(kWrongVerdicts, kAttempts * intervals);
}

bool asked_for(const std::string& id, const std::string& only) {
  return id.starts_with(only) || ::fnmatch(only.c_str(), id.c_str(), 0) == 0;
}

std::vector<cli::ValidateCase> run_cases(const Table& table, const RunOptions& options) {
  Runner runner(options, level_of(table));
  for (const Case& c : table.cases()) {
    if (!asked_for(c.id, options.only) || (options.quick && c.options.slow)) continue;
    runner.run(c);
  }
  return runner.take();
}

std::vector<cli::ValidateCase> run_case(const Table& table, std::size_t index, const RunOptions& options) {
  Runner runner(options, level_of(table));
  runner.run(table.cases().at(index));
  return runner.take();
}

}  // namespace ls::cases
