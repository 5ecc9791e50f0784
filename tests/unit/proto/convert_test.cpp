// Every message survives the round trip, and no invalid bytes pass the checks.
#include "proto/convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace ls::wire {
namespace {

using testing::HasSubstr;

Digest digest_of_text(const char* text) { return sha256(std::string_view(text)); }

RenderSettings settings() {
  RenderSettings s;
  s.size = {640, 480};
  s.integrator = "volpath";
  s.seed = 7;
  return s;
}

AssignLease assignment() {
  const RenderSettings s = settings();
  JobBrief brief{
      JobId{"j-1"}, digest_of_text("scene"), s, digest_of(s), {{digest_of_text("grid"), 12, "steam.vdb"}}};
  Lease lease{
      LeaseId{"l-1"}, JobId{"j-1"}, {{3, 2, {0, 32, 32, 64}, {4, 8}}, {4, 2, {32, 32, 64, 64}, {4, 8}}}};
  return {lease, brief};
}

Health unhealthy() {
  Health h;
  h.add(HealthCause::infinite, 1, {1, 2, 3});
  h.add(HealthCause::negative, 2, {1, 2, 3});
  h.add(HealthCause::majorant_violation, 3, {4, 2, 3});
  h.add(HealthCause::negative_density, 4);
  return h;
}

const std::vector<FromWorker> kFromWorker = {
    WorkerHello{kProtocolVersion,
                "n",
                "b",
                digest_of_text("class"),
                4,
                1 << 30,
                {"gpu", "big"},
                {digest_of_text("held")},
                "token",
                WorkerId{"w-9"},
                true,
                "armv8-a:gcc-14.2.0",
                "secret",
                4 << 20},
    WorkerProgress{{{LeaseId{"l-1"}, 3}}, "rendering", 1.5, 77, 0.25},
    UnitResult{{JobId{"j"}, 1, 2},
               LeaseId{"l"},
               {std::byte{1}, std::byte{0}},
               digest_of_text("u"),
               0.5,
               unhealthy()},
    UnitResult{{JobId{"j"}, 1, 2},
               LeaseId{"l"},
               {std::byte{1}},
               digest_of_text("u"),
               0.5,
               {},
               {.5, 1.5, .25, .125, .0625}},
    UnitFailure{{JobId{"j"}, 1, 2}, LeaseId{"l"}, true, "why", 11, std::pair{3, 4}, 99},
    UnitFailure{{JobId{"j"}, 1, 2}, LeaseId{"l"}, false, "why", {}, {}, {}},
    LeaseReturned{LeaseId{"l"}, {{JobId{"j"}, 5, 6}}, "its disk is full"},
    LeaseReturned{LeaseId{"l"}, {{JobId{"j"}, 5, 6}}, "", true},
    WorkerDraining{},
    WorkerDraining{.withdrawn = true},
    WorkerDraining{.restarts = true},
    WorkerDraining{.withdrawn = true, .refused = "its program is gone"},
};

const std::vector<ToWorker> kToWorker = {
    Welcome{WorkerId{"w-1"}, 3},
    Refused{{Errc::unauthenticated, "wrong join token"}, true},
    assignment(),
    ResultAck{{JobId{"j"}, 1, 2}, {}},
    ResultAck{{JobId{"j"}, 1, 2}, Error{Errc::failed_precondition, "no"}},
    CancelJob{JobId{"j"}},
    CancelLease{LeaseId{"l"}},
    RecallLease{LeaseId{"l"}},
    DrainNow{},
    DrainNow{.withdrawn = true},
    DrainNow{.restart = true},
};

template <class Message, class Wire>
Result<Message> over_the_wire(const Message& message, Wire wire) {
  wire.ParseFromString(to_wire(message).SerializeAsString());
  return from_wire(wire);
}

// A result without causes but with counts must not be taken for a healthy one.
TEST(Convert, KeepsCountsWithoutCauses) {
  pb::FromWorker wire = to_wire(FromWorker(kFromWorker[2]));
  wire.mutable_result()->set_nonfinite(5);
  const auto more = std::get<UnitResult>(from_wire(wire).value());
  EXPECT_EQ(more.health.nonfinite, 5u);
  EXPECT_EQ(more.health.causes.at(HealthCause::unnamed).count, 4u);

  wire.mutable_result()->clear_health();
  const auto old = std::get<UnitResult>(from_wire(wire).value());
  EXPECT_EQ(old.health.causes.at(HealthCause::unnamed).count, 5u);
  EXPECT_EQ(old.health.negative, 2u);

  wire.mutable_result()->set_health("[]");
  EXPECT_THAT(from_wire(wire).error().message, HasSubstr("result.health"));
}

TEST(Convert, ReadsEveryWorkerMessageBackAsItWas) {
  for (const FromWorker& message : kFromWorker) {
    const auto back = over_the_wire(message, pb::FromWorker{});

    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, message);
  }
}

TEST(Convert, ReadsEveryCoordinatorMessageBackAsItWas) {
  for (const ToWorker& message : kToWorker) {
    const auto back = over_the_wire(message, pb::ToWorker{});

    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, message);
  }
}

TEST(Convert, KeepsTheSpanOfALeaseAndTheTimeSinceAUnitIsHeld) {
  AssignLease lease = assignment();
  lease.trace = trace::parse_traceparent("00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01");
  EXPECT_EQ(over_the_wire(ToWorker(lease), pb::ToWorker{}).value(), ToWorker(lease));

  UnitResult result = std::get<UnitResult>(kFromWorker[3]);
  result.held_unix_ns = 1'700'000'000'000'000'000;
  EXPECT_EQ(over_the_wire(FromWorker(result), pb::FromWorker{}).value(), FromWorker(result));
}

TEST(Convert, IgnoresAnInvalidSpan) {
  pb::ToWorker wire = to_wire(ToWorker(assignment()));
  wire.mutable_assign()->set_traceparent(std::string(1 << 16, '-'));
  EXPECT_EQ(from_wire(wire).value(), ToWorker(assignment()));
}

// Each row damages a good message in one place; the error must name that place.
struct Damage {
  const char* field;
  void (*apply)(pb::FromWorker&);
  std::size_t message;  // index in kFromWorker
};
const Damage kDamages[] = {
    {"hello.numeric_class", [](pb::FromWorker& m) { m.mutable_hello()->set_numeric_class("short"); }, 0},
    {"hello.threads", [](pb::FromWorker& m) { m.mutable_hello()->set_threads(0); }, 0},
    {"hello.threads", [](pb::FromWorker& m) { m.mutable_hello()->set_threads(1 << 20); }, 0},
    {"hello.name", [](pb::FromWorker& m) { m.mutable_hello()->clear_name(); }, 0},
    {"hello.name", [](pb::FromWorker& m) { m.mutable_hello()->set_name(std::string(5000, 'x')); }, 0},
    {"hello.tags",
     [](pb::FromWorker& m) {
       for (int i = 0; i < 100; ++i) m.mutable_hello()->add_tags("t");
     },
     0},
    {"hello.blobs_held", [](pb::FromWorker& m) { m.mutable_hello()->add_blobs_held("x"); }, 0},
    {"hello.previous_id", [](pb::FromWorker& m) { m.mutable_hello()->set_previous_id("a\nb"); }, 0},
    {"progress.leases",
     [](pb::FromWorker& m) {
       for (int i = 0; i < 2000; ++i) m.mutable_progress()->add_leases();
     },
     1},
    {"progress.cpu_seconds_total", [](pb::FromWorker& m) { m.mutable_progress()->set_cpu_seconds_total(-1); },
     1},
    {"progress.load_seconds",
     [](pb::FromWorker& m) {
       m.mutable_progress()->set_load_seconds(std::numeric_limits<double>::quiet_NaN());
     },
     1},
    {"result.digest", [](pb::FromWorker& m) { m.mutable_result()->set_digest(std::string(33, 'x')); }, 2},
    {"result.cpu_seconds", [](pb::FromWorker& m) { m.mutable_result()->set_cpu_seconds(1.7e308); }, 2},
    {"result.times.load", [](pb::FromWorker& m) { m.mutable_result()->mutable_times()->set_load(1e13); }, 2},
    {"result.times.wait", [](pb::FromWorker& m) { m.mutable_result()->mutable_times()->set_wait(-1); }, 2},
    {"result.exr", [](pb::FromWorker& m) { m.mutable_result()->clear_exr(); }, 2},
    {"result.exr",
     [](pb::FromWorker& m) { m.mutable_result()->set_exr(std::string(limits::kPartialBytes + 1, 'x')); }, 2},
    {"unit.job", [](pb::FromWorker& m) { m.mutable_result()->clear_unit(); }, 2},
    {"failure.reason", [](pb::FromWorker& m) { m.mutable_failure()->set_reason(std::string(9000, 'x')); }, 4},
    {"returned.lease", [](pb::FromWorker& m) { m.mutable_returned()->set_lease(std::string(65, 'x')); }, 6},
    {"draining.refused", [](pb::FromWorker& m) { m.mutable_draining()->set_refused(std::string(9000, 'x')); },
     8},
    {"message", [](pb::FromWorker& m) { m.Clear(); }, 7},
};

TEST(Convert, NamesTheFieldThatIsWrong) {
  for (const Damage& damage : kDamages) {
    pb::FromWorker message = to_wire(kFromWorker[damage.message]);
    damage.apply(message);

    const auto result = from_wire(message);

    ASSERT_FALSE(result) << damage.field;
    EXPECT_EQ(result.error().code, Errc::invalid_argument);
    EXPECT_THAT(result.error().message, HasSubstr(damage.field));
  }
}

TEST(Convert, RefusesUnitsWithImpossibleRectanglesOrSamples) {
  const auto refused = [](auto damage) {
    pb::ToWorker message = to_wire(ToWorker{assignment()});
    damage(*message.mutable_assign()->mutable_units(0));
    return !from_wire(message);
  };

  EXPECT_TRUE(refused([](pb::LeaseUnit& u) { u.mutable_rect()->set_x1(0); }));
  EXPECT_TRUE(refused([](pb::LeaseUnit& u) { u.mutable_rect()->set_x0(-1); }));
  EXPECT_TRUE(refused([](pb::LeaseUnit& u) { u.mutable_rect()->set_y1(std::numeric_limits<int>::max()); }));
  EXPECT_TRUE(refused([](pb::LeaseUnit& u) { u.clear_rect(); }));
  EXPECT_TRUE(refused([](pb::LeaseUnit& u) { u.set_s1(u.s0()); }));
  EXPECT_TRUE(refused([](pb::LeaseUnit& u) { u.set_s1(u.s0() + 1); }));
  EXPECT_TRUE(refused([](pb::LeaseUnit& u) { u.set_s1(std::numeric_limits<std::uint64_t>::max() - 1); }));
}

TEST(Convert, RefusesABriefOfAnotherJob) {
  pb::ToWorker message = to_wire(ToWorker{assignment()});
  message.mutable_assign()->mutable_brief()->set_job("j-2");

  EXPECT_FALSE(from_wire(message));
}

TEST(Convert, KeepsEveryMessageWithinTheLimitAtItsLargest) {
  AssignLease lease = assignment();
  lease.lease.units.assign(limits::kUnitsPerLease, {~0U,
                                                    ~0U,
                                                    {limits::kFrameSide - 8, limits::kFrameSide - 8,
                                                     limits::kFrameSide, limits::kFrameSide},
                                                    {limits::kSampleIndex - 2, limits::kSampleIndex}});
  lease.brief->assets.assign(limits::kAssetsPerJob, {digest_of_text("x"), ~0ULL, std::string(4000, 'n')});
  WorkerHello hello = std::get<WorkerHello>(kFromWorker[0]);
  hello.blobs_held.assign(limits::kBlobsHeld, digest_of_text("x"));
  UnitResult result = std::get<UnitResult>(kFromWorker[2]);
  result.exr.assign(limits::kPartialBytes, std::byte{1});

  EXPECT_LT(to_wire(ToWorker{lease}).ByteSizeLong(), limits::kMessageBytes);
  EXPECT_LT(to_wire(FromWorker{hello}).ByteSizeLong(), limits::kMessageBytes);
  EXPECT_LT(to_wire(FromWorker{result}).ByteSizeLong(), limits::kMessageBytes);
}

TEST(Convert, SurvivesRandomlyDamagedBytes) {
  // Protobuf would log an error for each text that is no longer UTF-8.
  google::protobuf::SetLogHandler(nullptr);
  std::mt19937 random(20240607);
  for (int i = 0; i < 20000; ++i) {
    std::string bytes = i % 2 ? to_wire(kFromWorker[i / 2 % kFromWorker.size()]).SerializeAsString()
                              : to_wire(kToWorker[i / 2 % kToWorker.size()]).SerializeAsString();
    for (int k = 0; k < 3 && !bytes.empty(); ++k)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    pb::FromWorker from;
    pb::ToWorker to;
    // An accepted message must be within the limits, so it must survive the round trip.
    if (from.ParseFromString(bytes)) {
      const auto value = from_wire(from);
      EXPECT_TRUE(!value || over_the_wire(*value, pb::FromWorker{}));
    }
    if (to.ParseFromString(bytes)) {
      const auto value = from_wire(to);
      EXPECT_TRUE(!value || over_the_wire(*value, pb::ToWorker{}));
    }
  }
}

TEST(Convert, CutsLongTextsAtACharacterBoundary) {
  EXPECT_EQ(sendable("abc", 3), "abc");
  EXPECT_EQ(sendable("ab\xc3\xa9", 3), "ab");
}

TEST(Convert, SendsOnlyValidUtf8) {
  EXPECT_EQ(sendable("d\xc3\xa9j\xe0 \xff", 100), "d\xc3\xa9j? ?");
  EXPECT_EQ(sendable("\xed\xa0\x80\xf0\x9f\x8c\xab", 100), "???\xf0\x9f\x8c\xab");
  UnitFailure failure = std::get<UnitFailure>(kFromWorker[4]);
  failure.reason = "cannot read \xff\xfe.vdb";

  EXPECT_TRUE(over_the_wire(FromWorker{failure}, pb::FromWorker{}));
}

// The coordinator keeps this reason for each worker and job. An older worker may send a longer one.
TEST(FromWire, TruncatesTheReasonOfAReturnedLease) {
  pb::FromWorker wire = to_wire(FromWorker{LeaseReturned{LeaseId{"l"}, {}, std::string(4000, 'x')}});
  EXPECT_EQ(wire.returned().reason().size(), limits::kReasonBytes);
  wire.mutable_returned()->set_reason(std::string(limits::kReasonBytes - 1, 'x') + "\xc3\xa9 and more");

  const auto received = std::get<LeaseReturned>(from_wire(wire).value());

  EXPECT_EQ(received.reason, std::string(limits::kReasonBytes - 1, 'x')) << "between two characters";
}

TEST(FromWire, UnknownKindOfMessageIsRecognisedAsUnknown) {
  pb::FromWorker from;
  pb::ToWorker to;
  const std::string newer("\x9a\x06\x02hi", 5);  // the unknown field 99, with two bytes
  ASSERT_TRUE(from.ParseFromString(newer));
  ASSERT_TRUE(to.ParseFromString(newer));

  EXPECT_FALSE(known(from));
  EXPECT_FALSE(known(to));
  EXPECT_TRUE(known(to_wire(FromWorker{WorkerDraining{}})));
  EXPECT_TRUE(known(to_wire(ToWorker{DrainNow{}})));
}

TEST(Convert, RemovesControlCharactersFromReceivedTexts) {
  pb::FromWorker wire = to_wire(FromWorker(kFromWorker[4]));
  wire.mutable_failure()->set_reason("a\x1b[31mb");
  EXPECT_EQ(std::get<UnitFailure>(from_wire(wire).value()).reason, "a [31mb");
  wire.mutable_failure()->set_reason(
      "a\nb\xc2\x9b"
      "c\xe2\x80\xae"
      "d");
  EXPECT_EQ(std::get<UnitFailure>(from_wire(wire).value()).reason, "a\nb c d") << "a reason may have lines";

  pb::FromWorker hello = to_wire(FromWorker(kFromWorker[0]));
  hello.mutable_hello()->set_name(
      "a\nb\xc2\x9b"
      "c");
  EXPECT_EQ(std::get<WorkerHello>(from_wire(hello).value()).name, "a b c") << "a name has one line";
}

// A secret that is empty is another thing than none.
TEST(Convert, KeepsTheSecretOfAWorker) {
  for (const std::optional<std::string>& secret :
       {std::optional<std::string>(), std::optional<std::string>(""), std::optional<std::string>("s")}) {
    WorkerHello hello = std::get<WorkerHello>(kFromWorker[0]);
    hello.secret = secret;
    EXPECT_EQ(std::get<WorkerHello>(from_wire(to_wire(FromWorker{hello})).value()).secret, secret);
  }
  const Welcome welcome{{"w-1"}, 2, "secret"};
  EXPECT_EQ(std::get<Welcome>(from_wire(to_wire(ToWorker{welcome})).value()), welcome);
}

}  // namespace
}  // namespace ls::wire
