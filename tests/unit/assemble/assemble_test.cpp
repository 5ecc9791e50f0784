#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "coordinator/assemble/assembly.h"
#include "coordinator/assemble/job_report.h"
#include "coordinator/assemble/snapshot.h"
#include "coordinator/assemble/verify.h"
#include "coordinator/base/limits.h"
#include "tests/unit/store/temp_folder.h"
#include "worker/fake/fake_pixels.h"

namespace ls::coordinator {
namespace {

constexpr TileGrid kGrid{{48, 40}, 32};

UnitHeader header(TileIndex tile, SampleRange samples) {
  return {sha256("scene"), sha256("settings"), sha256("class"), kGrid.rect(tile), samples};
}
WaitingPartial waiting(TileIndex tile, SampleRange samples) {
  Partial partial = fake_partial(header(tile, samples));
  const Digest digest = unit_digest(partial);
  return {std::move(partial), std::nullopt, samples, digest, {}};
}
UnitResult result_of(const Partial& partial) {
  UnitResult r;
  r.unit = {{"j"}, 0, 2};
  r.exr = encode_partial(partial, kGrid.frame).value();
  r.digest = unit_digest(partial);
  return r;
}
std::string refusal(const Verified& v) {
  const auto* bad = std::get_if<BadResult>(&v);
  return bad ? bad->error.message : "";
}

TEST(RoundErrors, CheckpointIgnoresLaterRounds) {
  RoundErrors errors(2, true);
  TileError e;
  e.pixels = 1;
  for (RoundIndex r = 0; r < 3; ++r) {
    e.relative.squares = 10 + r;
    errors.folded(0, r, e);
  }
  e.relative.squares = 100;
  errors.folded(1, 0, e);

  const std::vector<RoundIndex> first{1, 1}, second{2, 2}, uneven{3, 1};
  EXPECT_EQ(errors.at(first).relative.squares, 110);
  EXPECT_EQ(errors.at(uneven).relative.squares, 112);
  errors.checkpoint_taken(first);
  e.relative.squares = 101;
  errors.folded(1, 1, e);
  EXPECT_EQ(errors.at(second).relative.squares, 112);
  errors.checkpoint_taken(uneven);
  EXPECT_EQ(errors.at(second).relative.squares, 113)
      << "the first tile was ahead: it counts with what it had";
  EXPECT_FALSE(errors.knows(second)) << "and that is not what it said then";
  EXPECT_TRUE(errors.knows(uneven));
  errors.discard(1);
  EXPECT_FALSE(errors.knows(uneven));
  errors.folded(1, 0, e), errors.folded(1, 1, e);
  EXPECT_TRUE(errors.knows(uneven));
  EXPECT_EQ(errors.relative(), (std::vector<std::vector<double>>{{10, 101}, {11, 101}, {12, 0}}));
  RoundErrors loaded(2, true);
  for (const TileIndex tile : {0, 1}) EXPECT_TRUE(loaded.load_tile(tile, errors.save_tile(tile)));
  EXPECT_EQ(loaded, errors);
}

TEST(RoundErrors, RefoldedRoundReplacesItsFirstFold) {
  RoundErrors again(1, true), once(1, true);
  TileError e;
  e.relative.squares = 1;
  again.folded(0, 0, e), again.folded(0, 1, e);
  once.folded(0, 0, e);

  e.relative.squares = 2;
  again.folded(0, 1, e);
  once.folded(0, 1, e);

  EXPECT_EQ(again, once);
}

TEST(RoundErrors, RefusesBytesCutAnywhere) {
  RoundErrors errors(2, true);
  errors.folded(0, 0, {});
  const auto bytes = errors.save_tile(0);
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_FALSE(RoundErrors(2, true).load_tile(0, std::span(bytes).first(n))) << n;
}

// Writes a snapshot of the assembly, as the service does.
void write_to(const std::filesystem::path& path, const Assembly& a, std::string_view format = "f") {
  auto file = SnapshotFile::create(path, ".new", a.film().grid(), a.film().aovs(), format).value();
  for (TileIndex t = 0; t < a.film().grid().count(); ++t)
    ASSERT_TRUE(file.add(snapshot_of(a.film(), a.errors(), a.health(), t)));
  ASSERT_TRUE(file.finish());
  ASSERT_TRUE(file.commit());
}

TEST(Assembly, SnapshotRestoresTheFilmAndDamageIsDetected) {
  TempFolder dir;
  const auto path = dir.path() / "film.snap";
  Assembly assembly(kGrid, false);
  for (TileIndex t = 0; t + 1 < kGrid.count(); ++t)  // the last tile stays without samples
    for (RoundIndex r = 0; r < 3; ++r) ASSERT_TRUE(assembly.fold(t, r, waiting(t, cut_range(r, 6))));

  write_to(path, assembly);

  const auto loaded = load_snapshot(path, kGrid, false, "f");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->film(), assembly.film());
  EXPECT_EQ(loaded->errors(), assembly.errors());
  EXPECT_FALSE(load_snapshot(path, {{48, 48}, 32}, false, "f"));
  EXPECT_FALSE(load_snapshot(path, kGrid, false, "g"));
  EXPECT_FALSE(load_snapshot(path, kGrid, false, "f", AovSet(1)));
  EXPECT_FALSE(load_snapshot(dir.path() / "none", kGrid, false, "f"));
  const auto bytes = read_file(path, 1 << 20).value();
  const auto with = [&](std::vector<std::byte> other) {
    EXPECT_TRUE(write_atomically(path, other));
    return load_snapshot(path, kGrid, false, "f").has_value();
  };
  for (std::size_t i = 0; i < bytes.size(); i += 997) {
    auto bad = bytes;
    bad[i] ^= std::byte{1};
    EXPECT_FALSE(with(bad)) << i;
    EXPECT_FALSE(with({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(i)})) << i;
  }
  auto longer = bytes;
  longer.push_back({});
  EXPECT_FALSE(with(longer));
  EXPECT_TRUE(with(bytes));
}

TEST(Assembly, SnapshotHasEachTileAsOfItsCopy) {
  TempFolder dir;
  Assembly assembly(kGrid, false);
  ASSERT_TRUE(assembly.fold(0, 0, waiting(0, {0, 2})));
  const Film first = assembly.film();
  auto file = SnapshotFile::create(dir.path() / "film.snap", ".new", kGrid, {}, "f").value();
  const TileSnapshot tile = snapshot_of(assembly.film(), assembly.errors(), assembly.health(), 0);
  ASSERT_TRUE(assembly.fold(0, 1, waiting(0, {2, 4})));
  ASSERT_TRUE(file.add(tile));
  EXPECT_FALSE(load_snapshot(dir.path() / "film.snap", kGrid, false, "f")) << "it is not at its place yet";

  ASSERT_TRUE(file.finish());
  ASSERT_TRUE(file.commit());

  EXPECT_EQ(load_snapshot(dir.path() / "film.snap", kGrid, false, "f")->film(), first);
}

TEST(Assembly, WaitingPartialCountsOnlyForItsOwnRange) {
  Assembly assembly(kGrid, false);
  assembly.hold(0, 2, waiting(0, {4, 6}));
  EXPECT_FALSE(assembly.take(0, 2, {4, 8}));
  EXPECT_TRUE(assembly.take(0, 2, {4, 6}));
}

TEST(Assembly, DiscardedTileHasNoError) {
  Assembly assembly(kGrid, false);
  const std::vector<RoundIndex> first(kGrid.count(), 1);
  ASSERT_TRUE(assembly.fold(0, 0, waiting(0, {0, 2})));
  const TileError one = assembly.errors().at(first);
  ASSERT_TRUE(assembly.fold(1, 0, waiting(1, {0, 2})));

  assembly.discard(1);

  EXPECT_EQ(assembly.errors().at(first), one);
}

TEST(Assembly, WaitingPartialsOfAllJobsShareAMemoryLimit) {
  const std::size_t before = WaitingBytes::all();
  constexpr std::size_t kEach = std::size_t{32} * 32 * 6 * sizeof(float);
  std::size_t kept = 0;
  {
    Assembly one(kGrid, false), other(kGrid, false);
    const PartialLog::Place on_disk{};
    for (RoundIndex r = 0; r < 4000; ++r) {
      WaitingPartial w = waiting(0, {0, 2});
      w.place = on_disk;
      (r % 2 == 0 ? one : other).hold(0, r, std::move(w));
    }
    for (RoundIndex r = 0; r < 4000; ++r)
      kept += (r % 2 == 0 ? one : other).take(0, r, {0, 2})->partial.has_value();
    EXPECT_EQ(kept, (limits::kMaxPendingPartials - before) / kEach);
    WaitingPartial nowhere = waiting(0, {0, 2});  // a partial that is on no disk is always kept
    one.hold(0, 0, std::move(nowhere));
    EXPECT_EQ(WaitingBytes::all(), before + kEach);
    Assembly moved = std::move(one);
    EXPECT_EQ(WaitingBytes::all(), before + kEach);
  }
  EXPECT_EQ(WaitingBytes::all(), before) << "what goes is not counted any more";
}

Health unhealthy(int x, std::uint64_t sample) {
  Health h;
  h.add(HealthCause::infinite, 1, {x, 0, sample});
  return h;
}

TEST(HealthTable, LongerRangeOfARoundReplacesATruncatedOne) {
  HealthTable table, at_once;
  table.folded(0, 0, {0, 2}, unhealthy(1, 0));
  table.folded(0, 1, {2, 4}, {});
  table.folded(0, 2, {4, 6}, unhealthy(1, 5));
  table.folded(1, 2, {4, 6}, unhealthy(33, 5));
  EXPECT_EQ(table.total().nonfinite, 3u);
  EXPECT_EQ(HealthTable::load(table.save()).value(), table);

  Health full = unhealthy(1, 5);
  full.merge(unhealthy(1, 7));
  table.folded(0, 2, {4, 8}, full);
  table.folded(1, 2, {4, 8}, {});

  at_once.folded(0, 0, {0, 2}, unhealthy(1, 0));
  at_once.folded(0, 2, {4, 8}, full);
  EXPECT_EQ(table, at_once);
  EXPECT_EQ(table.total().nonfinite, 3u);
}

TEST(HealthTable, DiscardedTileDoesNotCountUntilItIsFoldedAgain) {
  HealthTable table, at_once;
  table.folded(0, 0, {0, 2}, unhealthy(1, 0));
  table.folded(1, 0, {0, 2}, unhealthy(40, 0));
  table.folded(1, 2, {4, 6}, unhealthy(41, 5));

  table.discard(1);
  at_once.folded(0, 0, {0, 2}, unhealthy(1, 0));
  EXPECT_EQ(table, at_once);

  table.folded(1, 0, {0, 2}, unhealthy(42, 0));
  at_once.folded(1, 0, {0, 2}, unhealthy(42, 0));
  EXPECT_EQ(table, at_once);
}

TEST(HealthTable, RefusesTextCutAnywhereAndOtherText) {
  HealthTable table;
  table.folded(0, 0, {0, 2}, unhealthy(1, 0));
  table.folded(3, 2, {4, 6}, unhealthy(1, 5));
  const std::string text = table.save();
  const auto lines = [](std::string_view s) { return std::count(s.begin(), s.end(), '\n'); };
  for (std::size_t n = 0; n < text.size(); ++n) {
    const auto part = text.substr(0, n);
    EXPECT_EQ(HealthTable::load(part).has_value(), part.empty() || (part.ends_with('\n') && lines(part) == 1))
        << part;
  }
  for (const char* bad : {"x\n", "{}\n", "f 1{}\n", "f -1 {}\n", "t 1 []\n", "g 1 {}\n", "f 1\n"})
    EXPECT_FALSE(HealthTable::load(bad)) << bad;
  EXPECT_TRUE(HealthTable::load(""));
}

TEST(Assembly, SnapshotKeepsTheHealthOfFoldedResults) {
  Assembly assembly(kGrid, false);
  WaitingPartial first = waiting(0, {0, 2});
  first.health = unhealthy(1, 0);
  ASSERT_TRUE(assembly.fold(0, 0, first));
  TempFolder dir;
  write_to(dir.path() / "film.snap", assembly);
  EXPECT_EQ(load_snapshot(dir.path() / "film.snap", kGrid, false, "f").value().health(), assembly.health());
  EXPECT_EQ(assembly.health().total(), first.health);
}

TEST(Assembly, TailOfFewerSamplesDoesNotCountForMore) {
  Assembly assembly(kGrid, false);
  for (TileIndex t = 0; t < kGrid.count(); ++t)
    for (RoundIndex r = 0; r < 3; ++r) ASSERT_TRUE(assembly.fold(t, r, waiting(t, cut_range(r, 6))));
  EXPECT_EQ(assembly.rounds_for(6), std::vector<RoundIndex>(kGrid.count(), 3));
  EXPECT_EQ(assembly.rounds_for(8), std::vector<RoundIndex>(kGrid.count(), 2));
}

TEST(Verify, AcceptsOnlyRequestedResults) {
  const UnitHeader expected = header(0, {4, 8});
  const Partial good = fake_partial(expected);
  EXPECT_EQ(std::get<Partial>(verify_result(result_of(good), expected, kGrid.frame)), good);

  UnitResult wrong_digest = result_of(good);
  wrong_digest.digest = sha256("other");
  EXPECT_NE(refusal(verify_result(wrong_digest, expected, kGrid.frame)).find("digest"), std::string::npos);

  UnitHeader other = expected;
  other.numeric_class = sha256("other class");
  EXPECT_NE(refusal(verify_result(result_of(fake_partial(other)), expected, kGrid.frame)), "");

  UnitResult cut = result_of(good);
  cut.exr.resize(cut.exr.size() - 1);
  EXPECT_NE(refusal(verify_result(cut, expected, kGrid.frame)), "");

  UnitResult clock = result_of(good);
  clock.cpu_seconds = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(verify_result(clock, expected, kGrid.frame)), "");
}

TEST(Verify, AcceptsAPartialOfATruncatedRound) {
  const UnitHeader expected = header(0, {4, 8});
  const auto verified = verify_result(result_of(fake_partial(header(0, {4, 6}))), expected, kGrid.frame);
  ASSERT_TRUE(std::holds_alternative<OtherRange>(verified));
  EXPECT_EQ(std::get<OtherRange>(verified).samples, (SampleRange{4, 6}));
  EXPECT_NE(refusal(verify_result(result_of(fake_partial(header(0, {6, 8}))), expected, kGrid.frame)), "");
}

TEST(Report, HasEveryKeyOfTheContract) {
  ReportFacts facts;
  facts.job.stopped = StopReason::spp;
  facts.error = ImageError{};
  facts.convergence = {{1, 2, 4, {.1, .2, .1, .3}}};
  const auto j = nlohmann::json::parse(report_json(facts));
  for (const char* key :
       {"spp", "samples", "load_seconds", "render_seconds", "core_seconds", "peak_rss_bytes", "rmse",
        "relmse", "relmse_ci95", "nonfinite_samples", "pixels_sha256", "features_used", "features_left_out",
        "numeric_class", "stopped", "convergence"})
    EXPECT_TRUE(j.contains(key)) << key;
  for (const char* key : {"seconds", "core_seconds", "spp", "rmse", "relmse", "relmse_ci95"})
    EXPECT_TRUE(j["convergence"][0].contains(key)) << key;
  EXPECT_EQ(j["stopped"], "spp");
}

TEST(Report, HasAreaIntervalsOnlyForTrustedErrorsWithoutRareLight) {
  ReportFacts facts;
  facts.error = ImageError{.settled = true, .trusted = true};
  facts.areas = AreaError{{1, 2, 3}, {.5, .25, .125}, .01, .005, .02};
  const auto report = [&] { return nlohmann::json::parse(report_json(facts)); };

  EXPECT_EQ(report()["mean"], (nlohmann::json{1, 2, 3}));
  EXPECT_EQ(report()["mean_ci95"], (nlohmann::json{{.5, 1.5}, {1.75, 2.25}, {2.875, 3.125}}));
  EXPECT_EQ(report()["relmse_16"], .01);
  EXPECT_EQ(report()["relmse_16_ci95"], (nlohmann::json{.005, .02}));
  facts.areas->relmse_lo = facts.areas->relmse_hi = 0;  // too few squares
  EXPECT_TRUE(report()["relmse_16_ci95"].is_null());
  EXPECT_FALSE(report()["mean_ci95"].is_null());
  for (const ImageError& doubtful :
       {ImageError{.settled = false, .trusted = true},
        ImageError{.settled = true, .trusted = false, .verdict = "don't trust yet"}}) {
    facts.error = doubtful;
    EXPECT_TRUE(report()["mean_ci95"].is_null());
    EXPECT_EQ(report()["mean"], (nlohmann::json{1, 2, 3}));
  }
  facts.areas.reset();
  EXPECT_TRUE(report()["mean"].is_null());
}

TEST(Report, HasTheRequestedSettings) {
  ReportFacts facts;
  facts.job.settings.max_depth = 12;
  facts.job.settings.rr_depth = 3;
  auto j = nlohmann::json::parse(report_json(facts));
  EXPECT_EQ(j["max_depth"], 12);
  EXPECT_EQ(j["rr_depth"], 3);
  for (const char* key : {"spp_asked", "time_asked", "target_error"}) EXPECT_TRUE(j.at(key).is_null()) << key;
  facts.job.spp = 63;
  facts.job.spec.time = 1.5;
  j = nlohmann::json::parse(report_json(facts));
  EXPECT_EQ(j["spp_asked"], 64) << "as the job says it: two halves";
  EXPECT_EQ(j["time_asked"], 1.5);
}

// Facts of a job whose error is exactly proportional to 1/N.
ReportFacts falling() {
  ReportFacts facts;
  facts.job.name = "bath.xml";
  for (double n = 2; n <= 64; n *= 2)
    facts.convergence.push_back({n, 10 * n, n, {.1, 1 / n, .9 / n, 1.1 / n}});
  return facts;
}

TEST(Report, PredictsTheCostOfTheTarget) {
  ReportFacts facts = falling();
  facts.job.spec.target_error = 1.0 / 256;
  const auto j = nlohmann::json::parse(report_json(facts));
  const auto& f = j["forecast"];

  EXPECT_EQ(j["name"], "bath.xml");
  EXPECT_EQ(j["target_error"], 1.0 / 256);
  EXPECT_EQ(f["asked"], true);
  EXPECT_EQ(f["target"], 1.0 / 256);
  EXPECT_EQ(f["spp"], 256) << "the end of a round, and 1/256 is met there exactly";
  EXPECT_NEAR(f["core_seconds"].get<double>(), 10 * (256 - 64), 1e-6);
  EXPECT_LE(f["core_seconds_ci95"][0], f["core_seconds"]);
  EXPECT_GE(f["core_seconds_ci95"][1], f["core_seconds"]);
}

TEST(Report, ForecastsTheCostOfHalfTheErrorWithoutATarget) {
  ReportFacts reached = falling();
  reached.job.spec.target_error = .5;
  for (const ReportFacts& facts : {falling(), reached}) {
    const auto f = nlohmann::json::parse(report_json(facts))["forecast"];
    EXPECT_EQ(f["asked"], false);
    EXPECT_EQ(f["target"], 1.0 / 128);
    EXPECT_NEAR(f["core_seconds"].get<double>(), 10 * 64, 1e-6);
  }
  EXPECT_TRUE(nlohmann::json::parse(report_json(ReportFacts{}))["forecast"].is_null());
}

}  // namespace
}  // namespace ls::coordinator
