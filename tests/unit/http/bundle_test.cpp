// Bundles, valid and malicious ones; all are written here with libarchive.
#include "coordinator/http/bundle/bundle.h"

#include <archive.h>
#include <archive_entry.h>
#include <gmock/gmock.h>

#include <cstdio>

#include "core/job/limits.h"
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Item {
  std::string name, bytes;
  unsigned type = AE_IFREG;
  std::string link = {};
};
using Items = std::vector<Item>;

struct Packing {
  ArchiveKind kind = ArchiveKind::zip;
  const char* options = nullptr;
  bool gzip = false;
};
const Packing kZip{}, kTar{ArchiveKind::tar}, kTarGzip{ArchiveKind::tar, nullptr, true};

void write_item(archive* a, const Item& item) {
  archive_entry* e = archive_entry_new();
  archive_entry_set_pathname(e, item.name.c_str());
  archive_entry_set_filetype(e, item.type);
  archive_entry_set_perm(e, 0644);
  archive_entry_set_size(e, static_cast<la_int64_t>(item.bytes.size()));
  if (item.type == AE_IFLNK) archive_entry_set_symlink(e, item.link.c_str());
  if (item.type == AE_IFREG && !item.link.empty()) archive_entry_set_hardlink(e, item.link.c_str());
  EXPECT_GE(archive_write_header(a, e), ARCHIVE_WARN) << archive_error_string(a);
  if (!item.bytes.empty()) {
    EXPECT_EQ(archive_write_data(a, item.bytes.data(), item.bytes.size()),
              static_cast<la_ssize_t>(item.bytes.size()));
  }
  archive_entry_free(e);
}

std::string packed(const Packing& packing, const Items& items) {
  std::string out;
  archive* a = archive_write_new();
  if (packing.kind == ArchiveKind::zip)
    archive_write_set_format_zip(a);
  else
    archive_write_set_format_pax_restricted(a);
  if (packing.gzip) archive_write_add_filter_gzip(a);
  archive_write_set_bytes_in_last_block(a, 1);
  archive_write_set_passphrase(a, "secret");
  if (packing.options) {
    EXPECT_EQ(archive_write_set_options(a, packing.options), ARCHIVE_OK) << archive_error_string(a);
  }
  const auto append = [](archive*, void* to, const void* data, std::size_t n) {
    static_cast<std::string*>(to)->append(static_cast<const char*>(data), n);
    return static_cast<la_ssize_t>(n);
  };
  EXPECT_EQ(archive_write_open2(a, &out, nullptr, append, nullptr, nullptr), ARCHIVE_OK);
  for (const Item& item : items) write_item(a, item);
  EXPECT_EQ(archive_write_close(a), ARCHIVE_OK) << archive_error_string(a);
  archive_write_free(a);
  return out;
}

class Bundles : public ::testing::Test {
 protected:
  Result<Bundle> read(const std::string& bytes, ArchiveKind kind, BundleLimits limits = {}) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
    std::fwrite(bytes.data(), 1, bytes.size(), file.get());
    std::fflush(file.get());
    return read_bundle(::fileno(file.get()), bytes.size(), kind, limits, store, stop.get_token());
  }
  Result<Bundle> read(const Packing& packing, const Items& items, BundleLimits limits = {}) {
    return read(packed(packing, items), packing.kind, limits);
  }
  // Returns why the bundle is rejected. Checks that none of its files was stored.
  std::string refusal(const Packing& packing, const Items& items, BundleLimits limits = {}) {
    return refusal(packed(packing, items), packing.kind, limits);
  }
  std::string refusal(const std::string& bytes, ArchiveKind kind, BundleLimits limits = {}) {
    const auto got = read(bytes, kind, limits);
    EXPECT_FALSE(got);
    if (got) return "accepted";
    EXPECT_EQ(got.error().code, Errc::invalid_argument);
    EXPECT_FALSE(store.has(sha256("inside")));
    return got.error().message;
  }

  WatchedBlobs store;
  std::stop_source stop;
};

// Returns the items of an archive with `bad` among valid ones.
Items around(Item bad) { return {{"a.xml", "<scene/>"}, {"good", "inside"}, std::move(bad), {"later", "x"}}; }

TEST_F(Bundles, PutEveryFileIntoTheStoreByItsDigest) {
  const std::string large(3u << 20, 'v');
  for (const Packing& packing : {kZip, Packing{ArchiveKind::zip, "zip:compression=store"}, kTar, kTarGzip}) {
    const auto bundle = read(packing, {{"meshes", "", AE_IFDIR},
                                       {"meshes/ball.ply", "ply"},
                                       {"./bath.xml", "<scene/>"},
                                       {"grids//steam.vdb", large},
                                       {"w\xc3\xb6lkchen.vol", "vol"},
                                       {"empty", ""}});

    ASSERT_TRUE(bundle) << bundle.error().message;
    EXPECT_EQ(bundle->scene, "bath.xml");
    EXPECT_EQ(bundle->scene_digest, sha256("<scene/>"));
    EXPECT_EQ(bundle->spec, "{}");
    const std::map<std::string, Digest> expected{{"meshes/ball.ply", sha256("ply")},
                                                 {"grids/steam.vdb", sha256(large)},
                                                 {"w\xc3\xb6lkchen.vol", sha256("vol")},
                                                 {"empty", sha256("")}};
    EXPECT_EQ(bundle->assets, expected);
    for (const auto& [name, digest] : expected) EXPECT_TRUE(store.has(digest)) << name;
    EXPECT_TRUE(store.has(bundle->scene_digest));
    EXPECT_EQ(store.open_uploads, 0);
  }
}

TEST_F(Bundles, SceneIsAtTheTopOrInTheOnlyFolder) {
  EXPECT_EQ(read(kZip, {{"a.XML", "1"}, {"deeper/b.xml", "2"}, {"._a.xml", "3"}})->scene, "a.XML");
  const auto folder =
      read(kTar, {{"bath/b.xml", "2"}, {"bath/t/wood.png", "3"}, {"__MACOSX/bath/._b.xml", "4"}});
  ASSERT_TRUE(folder) << folder.error().message;
  EXPECT_EQ(folder->scene, "bath/b.xml");
  EXPECT_EQ(folder->assets.at("t/wood.png"), sha256("3"));
  EXPECT_THAT(refusal(kZip, {{"good", "inside"}, {"x/a.xml", "1"}}),
              HasSubstr("no .xml and no stage of USD at its top"));
  EXPECT_THAT(refusal(kZip, {{"a.xml", "1"}, {"b.xml", "inside"}}),
              AllOf(HasSubstr("\"a.xml\", \"b.xml\""), HasSubstr("job.json")));
}

TEST_F(Bundles, MayNameTheirSceneAndSpecInAJobFile) {
  const auto beside = read(kZip, {{"a.xml", "1"},
                                  {"s/b.xml", "2"},
                                  {"s/x.ply", "3"},
                                  {"t/wood.png", "4"},
                                  {"job.json", R"({"scene": "./s/b.xml", "spp": 8, "tags": ["big"]})"}});
  ASSERT_TRUE(beside) << beside.error().message;
  EXPECT_EQ(beside->scene, "s/b.xml");
  EXPECT_EQ(beside->scene_digest, sha256("2"));
  EXPECT_EQ(beside->assets.at("x.ply"), sha256("3")) << "names are as the scene writes them";
  EXPECT_EQ(beside->assets.at("../t/wood.png"), sha256("4"));
  EXPECT_EQ(parse_job_spec(beside->spec)->spp, 8u);

  const auto nested = read(kTar, {{"f/a.xml", "1"}, {"f/job.json", R"({"spec": {"seed": 5}})"}});
  ASSERT_TRUE(nested) << nested.error().message;
  EXPECT_EQ(nested->scene, "f/a.xml");
  EXPECT_EQ(parse_job_spec(nested->spec)->seed, 5u);

  const auto with_litter = read(kTar, {{"__MACOSX/job.json", "{"},
                                       {".git/job.json", "{"},
                                       {"f/a.xml", "1"},
                                       {"f/job.json", R"({"seed": 5})"}});
  ASSERT_TRUE(with_litter) << with_litter.error().message;
  EXPECT_EQ(parse_job_spec(with_litter->spec)->seed, 5u);
}

TEST_F(Bundles, InvalidJobFileIsRefused) {
  const std::pair<std::string, std::string> kCases[] = {
      {"{", "not JSON"},
      {"[]", "must be an object"},
      {R"({"scene": 5})", "'scene'"},
      {R"({"scene": "c.xml"})", "\"c.xml\" is named by job.json"},
      {R"({"scene": "../a.xml"})", "leads out"},
      {R"({"scene": "/a.xml"})", "absolute"},
      {R"({"spec": 5})", "'spec'"},
      {R"({"spec": {}, "spp": 4})", "'spec'"},
      {std::string(100, '[') + std::string(100, ']'), "deeper"},
      {"\"" + std::string(kMaxSpecBytes, 'x') + "\"", "more than"},
  };
  for (const auto& [text, says] : kCases)
    EXPECT_THAT(refusal(kZip, {{"a.xml", "1"}, {"good", "inside"}, {"job.json", text}}), HasSubstr(says))
        << text.substr(0, 100);
}

TEST_F(Bundles, NamesThatLeadOutAreRefused) {
  const std::pair<std::string, std::string> kCases[] = {
      {"../evil.ply", "leads out"},
      {"a/../../evil.ply", "leads out"},
      {"a/..", "leads out"},
      {"/etc/passwd", "absolute"},
      {"C:/evil.ply", "absolute"},
      {"a\nb.ply", "control characters"},
      {"a\x1b[2J.ply", "control characters"},
      {std::string(1100, 'n'), "more than 1024"},
  };
  for (const Packing& packing : {kZip, kTar, kTarGzip})
    for (const auto& [name, says] : kCases) {
      const std::string why = refusal(packing, around({name, "evil"}));
      EXPECT_THAT(why, AllOf(StartsWith("the bundle: \""), HasSubstr(says))) << name;
      EXPECT_EQ(why.find('\x1b'), std::string::npos);
    }
}

// Some programs write backslashes into a zip instead of slashes; libarchive converts them in a zip, not in a
// tar.
TEST_F(Bundles, BackslashesAreSeparatorsOnlyInZip) {
  EXPECT_THAT(refusal(kTar, around({"a\\b.ply", "x"})), HasSubstr("backslash"));
  EXPECT_THAT(refusal(kZip, around({"a\\..\\b.ply", "x"})), HasSubstr("leads out"));
  EXPECT_EQ(read(kZip, {{"a.xml", "1"}, {"t\\b.ply", "x"}})->assets.count("t/b.ply"), 1u);
}

TEST_F(Bundles, LinksAndDevicesAreRefused) {
  EXPECT_THAT(refusal(kTar, around({"l.ply", "", AE_IFLNK, "/etc/passwd"})),
              AllOf(HasSubstr("\"l.ply\""), HasSubstr("link")));
  EXPECT_THAT(refusal(kZip, around({"l.ply", "", AE_IFLNK, "good"})),
              AllOf(HasSubstr("\"l.ply\""), HasSubstr("link")));
  EXPECT_THAT(refusal(kTar, around({"h.ply", "", AE_IFREG, "good"})),
              AllOf(HasSubstr("\"h.ply\""), HasSubstr("link")));
  for (const unsigned type : {unsigned{AE_IFCHR}, unsigned{AE_IFBLK}, unsigned{AE_IFIFO}})
    EXPECT_THAT(refusal(kTar, around({"d.ply", "", type})),
                AllOf(HasSubstr("\"d.ply\""), HasSubstr("neither a file")))
        << type;
}

TEST_F(Bundles, DuplicateNameIsRefused) {
  for (const char* again : {"good", "./good", ".//./good"})
    for (const Packing& packing : {kZip, kTar})
      EXPECT_THAT(refusal(packing, around({again, "other"})), HasSubstr("twice")) << again;
}

TEST_F(Bundles, RefusalBeyondALimitNamesTheEntry) {
  const BundleLimits small{.entry_bytes = 10, .total_bytes = 15};
  EXPECT_TRUE(read(kZip, {{"a.xml", "1234567890"}, {"b", "12345"}}, small));
  for (const Packing& packing : {kZip, kTar, kTarGzip}) {
    EXPECT_THAT(refusal(packing, around({"large", "12345678901"}), small),
                AllOf(HasSubstr("\"large\""), HasSubstr("10 bytes")));
    EXPECT_THAT(refusal(packing, around({"more", "1234567"}), small),
                AllOf(HasSubstr("\"more\""), HasSubstr("15 bytes")));
  }
}

TEST_F(Bundles, RefuseTooManyEntries) {
  Items items{{"a.xml", "<scene/>"}, {"good", "inside"}};
  for (std::size_t i = 0; i < kMaxBundleEntries; ++i)
    items.push_back({"d" + std::to_string(i), "", AE_IFDIR});
  EXPECT_THAT(refusal(kTarGzip, items), HasSubstr("more than 100000 entries"));
}

TEST_F(Bundles, DecompressionBombIsRefusedNamingTheEntry) {
  const std::string zeros(100u << 20, '\0');
  for (const Packing& packing : {kZip, kTarGzip})
    EXPECT_THAT(refusal(packing, around({"bomb.vol", zeros})),
                AllOf(HasSubstr("\"bomb.vol\""), HasSubstr("implausibly")));
  const Items in_parts{{"a.xml", "<scene/>"},
                       {"good", "inside"},
                       {"1", std::string(30u << 20, '\0')},
                       {"2", std::string(30u << 20, '\0')},
                       {"3", std::string(30u << 20, '\0')}};
  EXPECT_THAT(refusal(kZip, in_parts), AllOf(HasSubstr("\"3\""), HasSubstr("implausibly")));
  EXPECT_TRUE(read(kTarGzip, {{"a.xml", "<scene/>"}, {"empty.vol", std::string(30u << 20, '\0')}}))
      << "grids may be empty";
}

// An archive is rejected wherever it is cut off, even between two entries.
TEST_F(Bundles, CutOffAnywhereAreRefused) {
  const Items items{{"a.xml", "<scene/>"}, {"good", "inside"}, {"b", std::string(700, 'b')}};
  const std::string zip = packed(kZip, items), tar = packed(kTar, items), gzip = packed(kTarGzip, items);
  for (std::size_t n = 0; n < zip.size(); n += 3) refusal(zip.substr(0, n), ArchiveKind::zip);
  // The three entries take 2 + 2 + 3 blocks of 512 bytes; the blocks of zeros follow.
  for (std::size_t n = 0; n <= 7 * 512; n += 128) refusal(tar.substr(0, n), ArchiveKind::tar);
  for (std::size_t n = 0; n < gzip.size() - 20; n += 3) refusal(gzip.substr(0, n), ArchiveKind::tar);
  EXPECT_TRUE(read(tar.substr(0, 8 * 512), ArchiveKind::tar)) << "one block of zeros ends a tar";
}

TEST_F(Bundles, DamagedAnywhereAreRefusedOrReadRight) {
  const Items items{{"a.xml", "<scene/>"}, {"good", "inside"}, {"b", std::string(700, 'b')}};
  const auto whole = read(kZip, items);
  const std::string zip = packed(kZip, items);
  for (std::size_t i = 0; i < zip.size(); ++i) {
    std::string damaged = zip;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x5a);
    const auto got = read(damaged, ArchiveKind::zip);
    if (!got) {
      EXPECT_FALSE(got.error().message.empty());
      continue;
    }
    // The archive has checksums of the bytes but not of the names.
    for (const auto& [name, digest] : got->assets)
      EXPECT_TRUE(digest == sha256("inside") || digest == sha256(std::string(700, 'b')) ||
                  digest == sha256("<scene/>"))
          << i;
  }
  ASSERT_TRUE(whole);
}

TEST_F(Bundles, EncryptedOrPackedUnusuallyAreRefused) {
  EXPECT_THAT(refusal({ArchiveKind::zip, "zip:encryption=traditional"}, {{"a.xml", "inside"}}),
              AllOf(HasSubstr("\"a.xml\""), HasSubstr("encrypted")));
  EXPECT_THAT(refusal({ArchiveKind::zip, "zip:encryption=aes256"}, {{"a.xml", "inside"}}),
              HasSubstr("encrypted"));
}

TEST_F(Bundles, RefuseAnotherFormatThanAnnounced) {
  const Items items{{"a.xml", "<scene/>"}, {"good", "inside"}};
  EXPECT_THAT(refusal(packed(kTar, items), ArchiveKind::zip), HasSubstr("zip"));
  EXPECT_THAT(refusal(packed(kZip, items), ArchiveKind::tar), HasSubstr("tar"));
  for (const std::string& garbage :
       {std::string(), std::string("PK"), std::string(5000, 'x'), std::string(5000, '\0')})
    for (const ArchiveKind kind : {ArchiveKind::zip, ArchiveKind::tar}) refusal(garbage, kind);
}

TEST_F(Bundles, StopWhenTheCoordinatorStops) {
  stop.request_stop();
  const auto got = read(kZip, {{"a.xml", "<scene/>"}});
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().code, Errc::unavailable);
}

class BundleJobs : public ApiTest {};

TEST_F(BundleJobs, QueryOverridesTheJobFile) {
  const Items items{{"bath.xml", with_mesh("ball.ply")},
                    {"ball.ply", "ply"},
                    {"job.json", R"({"spp": 8, "seed": 3, "defines": {"a": "1", "b": "2"}})"}};
  for (const auto& [packing, type] :
       {std::pair(kZip, "application/zip"), std::pair(kTar, "application/x-tar"),
        std::pair(kTarGzip, "application/gzip"), std::pair(kTarGzip, "application/x-tar")}) {
    const Response r = ask(Method::post, "/api/v1/jobs?spp=64&define=b=7", packed(packing, items), type);

    ASSERT_EQ(r.status, 201) << text(r);
    EXPECT_TRUE(json_of(r)["id"].is_string());
    const auto got = records->last_job();
    EXPECT_EQ(got.name, "bath.xml");
    ASSERT_EQ(got.assets.size(), 1u);
    EXPECT_EQ(got.assets[0].digest, sha256("ply"));
    EXPECT_EQ(got.spec.spp, 64u);
    EXPECT_EQ(got.spec.seed, 3u);
    EXPECT_EQ(got.spec.defines, (std::map<std::string, std::string>{{"a", "1"}, {"b", "7"}}));
  }
}

TEST_F(BundleJobs, ErrorsNameTheProblem) {
  const auto answer = [&](const Items& items, const std::string& target = "/api/v1/jobs") {
    const Response r = ask(Method::post, target, packed(kZip, items), "application/zip");
    return std::pair(r.status, json_of(r));
  };
  const auto [status, misspelt] = answer({{"s/bath.xml", kMisspeltScene}});
  EXPECT_EQ(status, 400);
  EXPECT_EQ(misspelt["diagnostics"][0]["file"], "s/bath.xml");
  EXPECT_EQ(misspelt["diagnostics"][0]["line"], 7);

  EXPECT_EQ(answer({{"a.xml", "x"}}, "/api/v1/jobs?sp=4").first, 400);
  EXPECT_EQ(answer({{"a.xml", "x"}, {"job.json", R"({"sp": 4})"}}).first, 400);
  EXPECT_EQ(answer({{"a.xml", "x"}, {"large", std::string(1001, 'x')}}).first, 400)
      << "the fixture's limit of a blob";
  EXPECT_EQ(ask(Method::post, "/api/v1/jobs", "not a zip", "application/zip").status, 400);
  Request long_one =
      request(Method::post, "/api/v1/jobs",
              {{"authorization", std::string("Bearer ") + kToken}, {"content-type", "application/zip"}});
  long_one.content_length = limits.bundle_bytes + 1;
  EXPECT_EQ(ask(long_one).status, 413);
  EXPECT_TRUE(coordinator->jobs().empty());
}

}  // namespace
}  // namespace ls::http::testing
