// Scenes are read by another process, which nothing that a scene does can harm.
#include "util/reading/scene_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "tests/unit/scene/scene_testing.h"
#include "tests/unit/store/temp_folder.h"
#include "util/reading/exchange.h"

namespace ls {
namespace {

namespace fs = std::filesystem;
using reading::Kind;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;

// Programs that stand in for lightshaft-scene send messages through the descriptor 3.
class SceneProcess : public testing::Test {
 protected:
  // Returns a reader whose program runs these commands of a shell.
  SceneReader reader_of(const std::string& commands, SceneLimits limits = {}) {
    const fs::path path = folder_.path() / "reader";
    std::ofstream(path) << "#!/bin/sh\n" << commands << "\n";
    fs::permissions(path, fs::perms::owner_all);
    return scenes_by_processes(path, limits)();
  }
  // Returns the message with which the reader refuses a scene.
  std::string refusal(const SceneReader& read) {
    const auto result = read("test.xml", with_sensor(""), assets_, {});
    if (result) return "it was read";
    EXPECT_EQ(result.error().code, Errc::invalid_argument);
    return result.error().message;
  }

  static std::string message(Kind kind, const std::vector<std::string>& fields) {
    std::string bytes(1, static_cast<char>(kind));
    const auto add = [&](auto number) {
      bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
    };
    add(static_cast<std::uint32_t>(fields.size()));
    for (const std::string& field : fields) add(std::uint64_t{field.size()});
    for (const std::string& field : fields) bytes += field;
    return bytes;
  }
  // Returns a reader whose program sends these bytes.
  SceneReader sender_of(const std::string& bytes) {
    std::ofstream(folder_.path() / "bytes") << bytes;
    return reader_of(fmt::format("cat {} >&3; exec cat <&3 >/dev/null", (folder_.path() / "bytes").string()));
  }

  coordinator::TempFolder folder_;
  MemoryAssets assets_;
};

TEST_F(SceneProcess, ReadsWhatTheReadersReadHere) {
  assets_.files["part.xml"] = R"(<scene version="3.0.0"><shape type="sphere" id="ball"/></scene>)";
  ReadOptions options{.defines = {{"width", "16"}, {"idle", "a\tb\xC3\xA4"}}, .frame = 7, .labels = true};
  const std::string good = with_sensor(
      R"(<include filename="part.xml"/><shape type="sphere"><transform name="to_world"><translate x="$frame"/></transform></shape>
<medium type="heterogeneous"><volume name="sigma_t" type="gridvolume"><string name="filename" value="cloud.vol"/></volume></medium>)");
  const std::string pbrt = "Camera \"perspective\"\nWorldBegin\nShape \"sphere\"\n";
  const auto process = scenes_by_processes()();
  for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
           {"good.xml", good},
           {"scene.pbrt", pbrt},
           {"wrong.xml", "<scene version=\"3.0.0\">\n  <shape type=\"spere\"/>\xFF\n"},
           {"missing.xml",
            with_sensor(R"(<shape type="obj"><string name="filename" value="no.obj"/></shape>)")},
           {"empty.xml", ""},
           {"scene.blend", "BLENDER"}}) {
    const ReadResult here = read_scene(name, text, assets_, options);
    const auto there = process(name, text, assets_, options);
    ASSERT_TRUE(there) << there.error().message;
    EXPECT_EQ(there->scene, here.scene) << name;
    EXPECT_EQ(there->diagnostics, here.diagnostics) << name;
  }
  ASSERT_TRUE(read_scene("good.xml", good, assets_, options).scene);  // the comparison is not of errors alone
}

TEST_F(SceneProcess, RefusesHugeNamesLikeNamesOfNoFile) {
  const std::string name(70 << 10, 'a');
  const auto read = scenes_by_processes()()(
      "huge.xml",
      with_sensor(R"(<shape type="obj"><string name="filename" value=")" + name + R"("/></shape>)"), assets_,
      {});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_FALSE(read->scene);
  ASSERT_EQ(read->diagnostics.size(), 1u);
  EXPECT_EQ(read->diagnostics[0].place.line, 2);
}

TEST_F(SceneProcess, ReadsManyScenesOneAfterAnother) {
  const auto process = scenes_by_processes()();
  for (std::uint32_t frame = 0; frame < 50; ++frame) {
    const auto read =
        process("t.xml", with_sensor(R"(<shape type="sphere"><float name="radius" value="$frame"/></shape>)"),
                assets_, {.frame = frame + 1});
    ASSERT_TRUE(read && read->scene) << frame;
    EXPECT_EQ(read->scene->shapes.size(), 1u);
  }
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // these builds have no sandbox
TEST_F(SceneProcess, IsShutInWhileItReads) {
  // The process waits for an answer while find() runs, so its state can be looked at.
  class Looking final : public AssetSource {
   public:
    std::string status;
    Result<Asset> find(std::string_view name) override {
      for (const auto& entry : fs::directory_iterator("/proc")) {
        std::ifstream file(entry.path() / "status");
        const std::string text{std::istreambuf_iterator<char>(file), {}};
        if (text.find(fmt::format("\nPPid:\t{}\n", ::getpid())) != text.npos &&
            text.starts_with("Name:\tlightshaft-scen"))
          status = text;
      }
      return Asset{std::string(name), sha256("p"), 1};
    }
    Result<std::string> text(std::string_view) override { return fail(Errc::not_found, "none"); }
  } looking;
  const auto read = scenes_by_processes()()(
      "t.xml", with_sensor(R"(<shape type="ply"><string name="filename" value="a.ply"/></shape>)"), looking,
      {});
  ASSERT_TRUE(read && read->scene);
  EXPECT_THAT(looking.status, HasSubstr("Seccomp:\t2\n"));
  EXPECT_THAT(looking.status, HasSubstr("NoNewPrivs:\t1\n"));
  EXPECT_THAT(looking.status, HasSubstr("CapEff:\t0000000000000000\n"));
}
#endif

TEST_F(SceneProcess, ThatEndsOrHangsCostsTheSceneOnly) {
  EXPECT_THAT(refusal(reader_of("kill -SEGV $$")), HasSubstr("crashed"));
  EXPECT_THAT(refusal(reader_of("exit 3")), HasSubstr("it may take 4096 MiB"));
  EXPECT_THAT(refusal(reader_of("exit 0")), HasSubstr("no answer and ended with 0"));
  EXPECT_THAT(refusal(reader_of("sleep 1000", {.seconds = 1})), HasSubstr("takes more than 1 s"));
  EXPECT_THAT(refusal(reader_of("kill -ALRM $$", {.seconds = 5})), HasSubstr("takes more than 5 s"));
  const auto missing = scenes_by_processes("/no/such/lightshaft-scene")()("t.xml", "", assets_, {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, Errc::internal);
  EXPECT_THAT(missing.error().message, HasSubstr("/no/such/lightshaft-scene"));
}

TEST_F(SceneProcess, ThatASceneHasTakenOverIsNotTrusted) {
  // Nothing that is a message: unknown kinds, more fields than allowed, fields that have more bytes than
  // allowed.
  EXPECT_THAT(refusal(reader_of("yes | head -c 100000 >&3; exec cat <&3 >/dev/null")),
              HasSubstr("gave no answer"));
  EXPECT_THAT(refusal(reader_of(R"(printf '\001\377\377\377\377' >&3; exec cat <&3 >/dev/null)")),
              HasSubstr("gave no answer"));
  EXPECT_THAT(
      refusal(reader_of(
          R"(printf '\001\001\000\000\000\377\377\377\377\377\377\377\377' >&3; exec cat <&3 >/dev/null)")),
      HasSubstr("gave no answer"));
  // It does not end by itself, nor when the channel is closed.
  EXPECT_THAT(refusal(reader_of("printf garbage >&3; exec sleep 1000")), HasSubstr("gave no answer"));
  EXPECT_THAT(refusal(reader_of("printf garbage >&3; sleep 1000")), HasSubstr("gave no answer"));
  // A scene that is none, and one of more bytes than its text can become
  EXPECT_THAT(refusal(sender_of(message(Kind::done, {"{}"}))), HasSubstr("cannot be read: "));
  EXPECT_THAT(refusal(sender_of(message(Kind::done, {std::string(20 << 20, '[')}))),
              HasSubstr("gave no answer"));
  // Names and reasons of any length
  EXPECT_THAT(refusal(sender_of(message(Kind::find, {std::string(70 << 10, 'a')}))),
              HasSubstr("gave no answer"));
  // A file that the scene did not ask for
  Scene scene =
      *read(with_sensor(R"(<shape type="ply"><string name="filename" value="mesh.ply"/></shape>)")).scene;
  EXPECT_THAT(refusal(sender_of(message(Kind::done, {serialize(scene)}))), HasSubstr("did not ask for"));
  scene = *read(with_sensor("")).scene;
  EXPECT_EQ(refusal(sender_of(message(Kind::done, {serialize(scene)}))), "it was read");
  // It sends a scene without end, byte by byte.
  EXPECT_THAT(refusal(reader_of(R"(printf '\001\001\000\000\000\000\000\000\001\000\000\000\000' >&3;
while printf a >&3; do :; done)",
                                {.seconds = 1})),
              HasSubstr("takes more than 1 s"));
  // It asks for files without end.
  EXPECT_THAT(refusal(reader_of(
                  R"(while printf '\002\001\000\000\000\001\000\000\000\000\000\000\000a' >&3; do :; done)",
                  {.seconds = 1})),
              HasSubstr("takes more than 1 s"));
}

TEST_F(SceneProcess, ThatEndedBeforeAnySceneCameIsReplaced) {
  // The first process is taken by the first reader, the second one waits for the next reader, and ends.
  const fs::path count = folder_.path() / "count", path = folder_.path() / "reader";
  std::ofstream(path) << fmt::format(
      "#!/bin/sh\necho >> {0}\n[ $(wc -l < {0}) = 2 ] && exit 1\nexec {1} \"$@\"\n", count.string(),
      program_beside_us("lightshaft-scene").string());
  fs::permissions(path, fs::perms::owner_all);
  const OpenReader open = scenes_by_processes(path);
  for (int i = 0; i < 3; ++i) {
    const auto read = open()("test.xml", with_sensor(""), assets_, {});
    ASSERT_TRUE(read && read->scene) << i;
  }
}

TEST_F(SceneProcess, EndsWhenTheCoordinatorStops) {
  const auto stop = std::make_shared<std::atomic<bool>>(false);
  const SceneReader read =
      reader_of("printf '\\006\\000\\000\\000\\000' >&3; exec sleep 1000", {.stop = stop});
  std::jthread stopper([&] { *stop = true; });
  const auto stopped = read("test.xml", with_sensor(""), assets_, {});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::unavailable);
}

TEST_F(SceneProcess, IsStartedAgainForTheNextFrame) {
  const fs::path crashed = folder_.path() / "crashed";
  const auto read = reader_of(fmt::format("[ -e {0} ] && exec {1} \"$@\"; kill -SEGV $$", crashed.string(),
                                          program_beside_us("lightshaft-scene").string()));
  EXPECT_THAT(refusal(read), HasSubstr("crashed"));
  std::ofstream(crashed).put('\n');
  const auto second = read("test.xml", with_sensor(""), assets_, {});
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->scene);
}

TEST(SceneExchange, TakesNoDiagnosticsOfAnotherForm) {
  const std::vector<Diagnostic> all = {{Diagnostic::Severity::warning, {"a.xml", 3, 4}, "text", "line", 5}};
  const auto fields = reading::to_fields(all);
  EXPECT_EQ(reading::to_diagnostics(fields), all);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    auto fewer = fields;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_FALSE(reading::to_diagnostics(fewer)) << i;
  }
  auto number = fields;
  number[2] = "99999999999";
  EXPECT_FALSE(reading::to_diagnostics(number));
  auto control = fields;
  control[4] = "forged\x1b[2Jline\xFF";
  EXPECT_THAT(*reading::to_diagnostics(control), ElementsAre(Field(&Diagnostic::text, "forged [2Jline?")));
  std::vector<std::string> many;
  for (int i = 0; i < 21; ++i) many.insert(many.end(), fields.begin(), fields.end());
  EXPECT_FALSE(reading::to_diagnostics(many)) << "more than a reader reports";
}

TEST(SceneExchange, ReceivesNoMoreBytesThanAllowed) {
  int ends[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  const Descriptor from(ends[0]), to(ends[1]);
  for (const Kind kind : {Kind::read, Kind::done, Kind::contents}) {
    ASSERT_TRUE(reading::send(from.fd, {kind, {std::string(100, 'a')}}));
    EXPECT_TRUE(reading::receive(to.fd, 100));
    ASSERT_TRUE(reading::send(from.fd, {kind, {std::string(101, 'a')}}));
    EXPECT_FALSE(reading::receive(to.fd, 100)) << static_cast<int>(kind);
    std::string rest(101, '\0');
    ASSERT_TRUE(receive_all(to.fd, rest.data(), rest.size()));
  }
}

TEST(SceneExchange, TakesNoOptionsOfAnotherForm) {
  const ReadOptions options{.defines = {{"a", "1"}}, .strict = true, .frame = 3};
  const auto fields = reading::to_fields(options);
  const auto back = reading::to_options(fields);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->defines, options.defines);
  EXPECT_TRUE(back->strict && !back->labels && back->frame == 3u);
  EXPECT_FALSE(reading::to_options({"0", "0"}));
  EXPECT_FALSE(reading::to_options({"0", "0", "x"}));
  EXPECT_FALSE(reading::to_options({"0", "0", "", "name without value"}));
}

}  // namespace
}  // namespace ls
