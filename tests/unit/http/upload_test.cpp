// Uploads in parts, and jobs of other coordinators.
#include <tuple>

#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

class Uploads : public ApiTest {};

TEST_F(Uploads, PartsAreKeptUntilTheUploadIsComplete) {
  const std::string url = "/api/v1/blobs/" + sha256("grid").hex();
  const auto part = [&](const char* range, const char* body) {
    return ask(request(Method::put, url,
                       {{"authorization", std::string("Bearer ") + kToken}, {"content-range", range}}, body));
  };

  const Response first = part("bytes 0-1/4", "gr");
  EXPECT_EQ(first.status, 202);
  EXPECT_EQ(header(first, "Upload-Offset"), "2");
  const Response probe = ask(Method::head, url);
  EXPECT_EQ(probe.status, 404);
  EXPECT_EQ(header(probe, "Upload-Offset"), "2");
  EXPECT_EQ(header(probe, "Upload-Complete"), "?0");

  // A part that does not begin where the received bytes end is rejected with the right offset.
  for (const auto& [range, body, status] :
       std::initializer_list<std::tuple<const char*, const char*, int>>{{"bytes 3-3/4", "d", 409},
                                                                        {"bytes 0-3/4", "grid", 409},
                                                                        {"bytes */4", "", 409},
                                                                        {"bytes 2-4/4", "idx", 416},
                                                                        {"bytes 2-1/4", "", 416},
                                                                        {"bytes 2-3/4", "i", 400},
                                                                        {"bytes 2-2/4", "id", 400}}) {
    const Response wrong = part(range, body);
    EXPECT_EQ(wrong.status, status) << range;
    EXPECT_EQ(header(wrong, "Upload-Offset"), "2") << range;
  }
  for (const char* nonsense :
       {"bytes 2-3", "2-3/4", "bytes 2-3/*", "bytes -3/4", "bytes 2-3/99999999999999999999"})
    EXPECT_EQ(part(nonsense, "id").status, 400) << nonsense;

  EXPECT_EQ(part("bytes 2-3/4", "id").status, 201);
  EXPECT_TRUE(blobs->has(sha256("grid")));
  EXPECT_EQ(part("bytes 2-3/4", "id").status, 204);
}

TEST_F(Uploads, TokenBeyondItsShareLosesOnlyItsOwnOldestUpload) {
  const std::string mallory = tokens.add(Role::submit, "mallory")->token;
  const auto begin = [&](const std::string& token, const Digest& digest) {
    return ask(request(Method::put, "/api/v1/blobs/" + digest.hex(),
                       {{"authorization", "Bearer " + token}, {"content-range", "bytes 0-0/4"}}, "x"))
        .status;
  };
  constexpr std::size_t kShare = coordinator::limits::kMaxUnfinishedUploads / 4;
  const auto part = [](std::size_t i) { return sha256(std::to_string(i)); };
  EXPECT_EQ(begin(kToken, sha256("anna's")), 202);

  for (std::size_t i = 0; i < kShare + 3; ++i) ASSERT_EQ(begin(mallory, part(i)), 202);

  EXPECT_EQ(blobs->received(sha256("anna's")), 1u);
  for (std::size_t i = 0; i < kShare + 3; ++i) EXPECT_EQ(blobs->received(part(i)), i < 3 ? 0u : 1u) << i;
}

TEST_F(Uploads, CompletePartsCanBeFinishedWithAnEmptyBody) {
  const Digest digest = sha256("grid");
  ASSERT_TRUE(blobs->resume_upload(digest, 0).value()->append(std::as_bytes(std::span("grid", 4))));

  const Response answer =
      ask(request(Method::put, "/api/v1/blobs/" + digest.hex(),
                  {{"authorization", std::string("Bearer ") + kToken}, {"content-range", "bytes */4"}}, ""));

  EXPECT_EQ(answer.status, 201);
}

TEST_F(Uploads, PartOfATooLargeBlobIsRefusedBeforeAnyByteIsStored) {
  const Digest digest = sha256("large");
  const Response answer = ask(request(
      Method::put, "/api/v1/blobs/" + digest.hex(),
      {{"authorization", std::string("Bearer ") + kToken}, {"content-range", "bytes 0-3/99999999"}}, "grid"));

  EXPECT_EQ(answer.status, 413);
  EXPECT_EQ(blobs->received(digest), 0u);
}

TEST_F(Uploads, RequestForAnotherCoordinatorsJobIsRedirected) {
  records->others["j-77"] = {"http://there:8080", true};
  records->others["j-78"] = {"http://there:8080", false};

  const Response moved = ask(Method::get, "/api/v1/jobs/j-77/image.png?exposure=-1");
  EXPECT_EQ(moved.status, 307);
  EXPECT_EQ(header(moved, "Location"), "http://there:8080/api/v1/jobs/j-77/image.png?exposure=-1");
  EXPECT_EQ(ask(Method::get, "/api/v1/jobs/j-78").status, 503);
  EXPECT_EQ(ask(Method::get, "/api/v1/jobs/j-79").status, 404);
}

}  // namespace
}  // namespace ls::http::testing
