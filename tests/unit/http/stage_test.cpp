// Stages of USD, read by a shell script in place of the Python package.
#include "coordinator/http/bundle/stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "coordinator/store/blobs/memory_blobs.h"

namespace ls::http {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class Stages : public ::testing::Test {
 protected:
  Stages() { fs::create_directories(folder); }
  ~Stages() override { fs::remove_all(folder); }

  // The script runs in place of the package, once it was asked for the folders that it needs.
  Result<std::unique_ptr<StageReader>> reader(const std::string& script, unsigned seconds = 60) {
    const fs::path program = folder / "python";
    std::ofstream(program) << "#!/bin/sh\nif [ \"$3\" = -c ]; then printf /usr >&3; exit 0; fi\n" << script;
    fs::permissions(program, fs::perms::owner_all);
    return StageReader::open({.python = program, .folder = folder / "stages", .seconds = seconds});
  }
  Digest add(std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text));
    const Digest digest = sha256(bytes);
    EXPECT_TRUE(blobs.put(digest, bytes));
    return digest;
  }
  std::string refusal(StageReader& reader, const Stage& stage) {
    const auto scene = reader.read(stage, "ada", {}, blobs, {});
    EXPECT_FALSE(scene);
    if (scene) return {};
    EXPECT_EQ(scene.error().code, Errc::invalid_argument);
    return scene.error().message;
  }

  const fs::path folder = fs::temp_directory_path() / ("stages-" + std::to_string(::getpid()));
  coordinator::MemoryBlobs blobs;
};

TEST_F(Stages, EndEvenIfTheyIgnoreTheirTime) {
  auto stages = reader("trap '' ALRM\nwhile :; do :; done\n", 1);
  ASSERT_TRUE(stages) << stages.error().message;

  EXPECT_THAT(refusal(**stages, {"shot.usda", add("#usda 1.0\n"), {}, {}, {}}),
              HasSubstr("took longer than 1 s"));
  EXPECT_TRUE(fs::is_empty(folder / "stages"));
}

TEST_F(Stages, AreLaidOutByTheNamesOfTheirFiles) {
  auto stages = reader(
      "d=\"${5%/*}\"; for f in \"$d\"/* \"$d\"/../* \"$d\"/../../x/*; do echo \"$f\" >&3; done; exit 2\n");
  ASSERT_TRUE(stages) << stages.error().message;
  const Digest same = add("content");

  const std::string refused = refusal(
      **stages,
      {"show/shot.usdz", add("#usda 1.0\n"), {{"a", same}, {"../b", same}, {"../../x/c", same}}, {}, {}});

  EXPECT_THAT(refused, AllOf(HasSubstr("a\nshot.usd\n"), HasSubstr("\n../b\n"), HasSubstr("\n../../x/c")));
  EXPECT_THAT(refused, Not(HasSubstr(folder.string())));
}

// Other files may name the stage's file, and USD tells formats by the endings of names.
TEST_F(Stages, KeepTheirNamesUnlessTheseMislead) {
  auto stages = reader("echo \"${5##*/}\" >&3; exit 2\n");
  ASSERT_TRUE(stages) << stages.error().message;
  const Digest text = add("#usda 1.0\n"), crate = add("PXR-USDC0"), zip = add("PK\x03\x04 and more");

  for (const auto& [name, file, kept] : std::vector<std::tuple<std::string, Digest, std::string>>{
           {"shot.usda", text, "shot.usda"},
           {"a/shot.usd", text, "shot.usd"},
           {"shot.usdc", text, "shot.usd"},
           {"shot.usdc", crate, "shot.usdc"},
           {"shot.usda", crate, "shot.usd"},
           {"shot.usdz", zip, "shot.usdz"},
           {"shot.usda", zip, "shot.usdz"},
           {"shot.xml", text, "shot.usd"},
           {std::string(300, 'b') + ".usda", text, "stage.usd"}})
    EXPECT_EQ(refusal(**stages, {name, file, {}, {}, {}}), name + ": " + kept);
}

TEST_F(Stages, NamesThatCannotBeLaidOutAreRefused) {
  auto stages = reader("exit 2\n");
  ASSERT_TRUE(stages) << stages.error().message;
  const Digest main = add("#usda 1.0\n"), file = add("x");
  std::string deep, climbing;
  for (int i = 0; i < 65; ++i) deep += "a/";
  for (int i = 0; i < 33; ++i) climbing += "../";

  for (const auto& [name, why] :
       std::vector<std::pair<std::string, std::string>>{{deep + "f", "folders deep"},
                                                        {climbing + "f", "too many folders up"},
                                                        {std::string(201, 'b'), "more than 200 bytes"},
                                                        {"/etc/f", "absolute"},
                                                        {"shot.usda", "twice"},
                                                        {"\x7f/f", "control"}})
    EXPECT_THAT(refusal(**stages, {"shot.usda", main, {{name, file}}, {}, {}}), HasSubstr(why));
  EXPECT_THAT(refusal(**stages, {"shot.usda", main, {{"a", file}, {"a/b", file}}, {}, {}}),
              HasSubstr("a folder of another file"));
}

TEST_F(Stages, ManyDeepNamesAreLaidOutSoon) {
  auto stages = reader("exit 2\n");
  ASSERT_TRUE(stages) << stages.error().message;
  Stage stage{"shot.usda", add("#usda 1.0\n"), {}, {}, {}};
  const Digest file = add("x");
  std::string deep;
  for (int i = 0; i < 60; ++i) deep += "a/";
  for (int i = 0; i < 4000; ++i) stage.files.emplace(deep + std::to_string(i), file);

  EXPECT_THAT(refusal(**stages, stage), HasSubstr("cannot be read"));
}

// The script of the first stage goes on until the second one was refused.
TEST_F(Stages, OfOneCallerAreReadOneByOne) {
  auto stages = reader("while [ -e \"${5%/*}/wait\" ] && [ -e " + (folder / "held").string() +
                       " ]; do :; done; exit 2\n");
  ASSERT_TRUE(stages) << stages.error().message;
  (void)!std::ofstream(folder / "held").good();
  const Stage held{"shot.usda", add("#usda 1.0\n"), {{"wait", add("x")}}, {}, {}};
  const Stage other{"shot.usda", add("#usda 1.0\n"), {}, {}, {}};
  std::jthread first([&] { (void)(*stages)->read(held, "ada", {}, blobs, {}); });
  while (fs::is_empty(folder / "stages")) std::this_thread::yield();

  const auto second = (*stages)->read(other, "ada", {}, blobs, {});
  const auto of_bob = (*stages)->read(other, "bob", {}, blobs, {});
  fs::remove(folder / "held");

  ASSERT_FALSE(second || of_bob);
  EXPECT_EQ(second.error().code, Errc::unavailable);
  EXPECT_EQ(of_bob.error().code, Errc::invalid_argument) << "another user's stage is read";
}

TEST_F(Stages, MayNotSeeTheDataFolder) {
  const fs::path program = folder / "python";
  std::ofstream(program) << "#!/bin/sh\nprintf " << folder.string() << " >&3\n";
  fs::permissions(program, fs::perms::owner_all);

  const auto stages = StageReader::open({.python = program, .folder = folder / "stages"});

  ASSERT_FALSE(stages);
  EXPECT_EQ(stages.error().code, Errc::failed_precondition);
  EXPECT_THAT(stages.error().message, HasSubstr("put one of the two elsewhere"));
}

TEST(Stage, IsKnownByItsContent) {
  const auto stage = [](std::string_view name, std::string_view text) {
    return is_stage(name, std::as_bytes(std::span(text)));
  };
  EXPECT_TRUE(stage("shot.xml", "#usda 1.0"));
  EXPECT_TRUE(stage("shot", "PXR-USDC"));
  EXPECT_TRUE(stage("shot.USDZ", "PK\x03\x04"));
  EXPECT_TRUE(stage("shot.usda", "nonsense"));
  EXPECT_FALSE(stage("shot.usda", "<scene")) << "as the Python package sends it";
  EXPECT_FALSE(stage("shot.usda", "\xef\xbb\xbf <sce"));
  EXPECT_FALSE(stage("shot.usda", ""));
  EXPECT_FALSE(stage("shot.pbrt", "#usdabout"));
  EXPECT_FALSE(stage("shot.zip", "PK\x03\x04"));
}

}  // namespace
}  // namespace ls::http
