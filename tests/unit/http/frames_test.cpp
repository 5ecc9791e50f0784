// Sequences over HTTP: submission with a range of frames, requests for one frame (?frame=), and event streams
// with the events of all frames.
#include "coordinator/http/net/event_queue.h"
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

using FramesTest = ApiTest;

TEST_F(FramesTest, ReadsTheRangeFromQueryAndJson) {
  EXPECT_EQ(ask(Method::post, "/api/v1/jobs?frames=1-10x2", kSceneText, "application/xml").status, 201);
  EXPECT_EQ(records->last_job().spec.frames, (FrameRange{1, 10, 2}));
  const std::string scene = blobs->add(kSceneText).hex();
  EXPECT_EQ(
      ask(Method::post, "/api/v1/jobs", R"({"scene": ")" + scene + R"(", "spec": {"frames": "3-4"}})").status,
      201);
  EXPECT_EQ(records->last_job().spec.frames, (FrameRange{3, 4, 1}));

  const auto refused = ask(Method::post, "/api/v1/jobs?frames=1-1000000000", kSceneText, "application/xml");

  EXPECT_EQ(refused.status, 400);
  EXPECT_NE(json_of(refused)["detail"].get<std::string>().find("frames"), std::string::npos);
}

TEST_F(FramesTest, NamesOneFrameInTheQuery) {
  const std::string id = submit();
  const auto asked = [&](const std::string& query) { return ask(Method::get, "/api/v1/jobs/" + id + query); };
  EXPECT_EQ(asked("").status, 200);
  const auto other = asked("?frame=7");  // this coordinator has no sequences
  EXPECT_EQ(other.status, 404);
  EXPECT_NE(text(other).find(id + "-frame7"), std::string::npos) << text(other);
  for (const char* query : {"?frame=", "?frame=x", "?frame=-1", "?frame=7x", "?frame=99999999"})
    EXPECT_EQ(asked(query).status, 400) << query;
  for (const char* what :
       {"/image.exr", "/image.png", "/report", "/tiles", "/log", "/convergence.csv", "/events"})
    EXPECT_EQ(asked(std::string(what) + "?frame=7").status, 404) << what;
  EXPECT_EQ(ask(Method::patch, "/api/v1/jobs/" + id + "?frame=7", R"({"state": "cancelled"})").status, 404);
  EXPECT_EQ(json_of(asked(""))["state"], "queued") << "the job itself was not meant";
}

TEST_F(FramesTest, DistinguishesImagesSequencesAndFrames) {
  const auto job = json_of(ask(Method::get, "/api/v1/jobs/" + submit()));
  for (const char* key : {"frames", "frame", "sequence"}) EXPECT_TRUE(job.at(key).is_null()) << key;
}

TEST(FramesInStreams, SequenceStreamHasTheEventsOfItsFrames) {
  EventQueue queue({100, 1 << 20}, "j-1", 0, [] {});
  std::uint64_t id = 0;
  for (const char* job : {"j-1", "j-1-frame3", "j-12-frame3", "j-12", "j-1-frame3x", "j-2"})
    queue.push({++id, "job", std::string("\"") + job + "\"", job});
  const std::string told = queue.take();
  EXPECT_NE(told.find("\"j-1\""), std::string::npos);
  EXPECT_NE(told.find("\"j-1-frame3\""), std::string::npos);
  for (const char* other : {"\"j-12-frame3\"", "\"j-12\"", "\"j-1-frame3x\"", "\"j-2\""})
    EXPECT_EQ(told.find(other), std::string::npos) << other;
}

}  // namespace
}  // namespace ls::http::testing
