#include "util/reading/scene_process.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <exception>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/clock.h"
#include "core/scene/json/serialize.h"
#include "core/scene/limits.h"
#include "util/reading/exchange.h"

namespace ls {
namespace {

using namespace reading;

// Bytes that the canonical form of a scene may have: at least, and for each byte of its text. For spheres and
// cylinders without transforms 15 were measured; the shortest nodes of glTF become more.
constexpr std::size_t kLeastDoneBytes = std::size_t{16} << 20, kDoneBytesPerTextByte = 128;
// The diagnostics come with it.
constexpr std::size_t kMostDoneBytes = scene::kMaxSceneJsonBytes + (std::size_t{1} << 20);
constexpr std::chrono::milliseconds kEndSoon{200};

// One run of the program, and our end of the channel to it. The destructor ends the program.
class SceneProcess {
 public:
  static Result<std::unique_ptr<SceneProcess>> start(const std::filesystem::path& program,
                                                     const SceneLimits& limits) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
      return fail(Errc::resource_exhausted, fmt::format("no scene can be read: {}", std::strerror(errno)));
    auto ours = std::make_unique<Descriptor>(ends[0]);
    auto theirs = std::make_unique<Descriptor>(ends[1]);
    try {
      return std::unique_ptr<SceneProcess>(
          new SceneProcess(program, limits, std::move(ours), std::move(theirs)));
    } catch (const std::system_error& e) {  // no thread can be started
      return fail(Errc::resource_exhausted, fmt::format("no scene can be read: {}", e.what()));
    }
  }
  ~SceneProcess() { end(); }
  // Ends the program, and returns at once.
  void end() {
    kill_ = true;
    ours_.reset();
  }
  bool has_ended() const { return ended_.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }
  // True if the program has got a scene.
  bool has_begun() const { return begun_; }
  bool is_late() const { return late_; }
  bool is_stopped() const { return limits_.stop && *limits_.stop; }

  // Reads a scene. nullopt: the process has ended, or does not keep to the protocol; why() has the reason.
  std::optional<ReadResult> read(std::string_view file_name, std::string_view text, AssetSource& assets,
                                 const ReadOptions& options);
  // Waits for the end of the process, and returns what ended it.
  Result<std::string> why();

 private:
  SceneProcess(const std::filesystem::path& program, const SceneLimits& limits,
               std::unique_ptr<Descriptor> ours, std::unique_ptr<Descriptor> theirs)
      : limits_(limits), ours_(std::move(ours)) {
    std::promise<Result<HelperEnd>> ended;
    ended_ = ended.get_future();
    // The thread owns their end, so that ours is closed for us when the process has ended.
    waiter_ = std::jthread([this, program, theirs = std::move(theirs), ended = std::move(ended)]() mutable {
      Result<HelperEnd> end = fail(Errc::resource_exhausted, "");
      try {
        end = run_helper(program, {std::to_string(limits_.seconds), std::to_string(limits_.memory_bytes)},
                         theirs->fd, &kill_);
      } catch (const std::exception& e) {  // no thread or no memory for it
        end = fail(Errc::resource_exhausted, e.what());
      }
      ended.set_value(std::move(end));
      theirs.reset();
    });
  }

  // The files that find() has found for the present scene, by name.
  using Found = std::map<std::string, Asset, std::less<>>;
  static std::optional<Message> answer(const Message& asked, AssetSource& assets, Found& found,
                                       std::size_t& text_bytes);
  std::optional<ReadResult> refused(std::string why) {
    problem_ = std::move(why);
    return std::nullopt;
  }

  const SceneLimits limits_;
  const SystemClock clock_;
  bool late_ = false, begun_ = false;
  std::string problem_;  // what is wrong with the scene that the process sent
  std::atomic<bool> kill_{false};
  std::unique_ptr<Descriptor> ours_;
  std::future<Result<HelperEnd>> ended_;
  std::jthread waiter_;
};

std::optional<Message> SceneProcess::answer(const Message& asked, AssetSource& assets, Found& found,
                                            std::size_t& text_bytes) {
  if (asked.fields.size() != 1) return std::nullopt;
  const std::string& name = asked.fields[0];
  if (asked.kind == Kind::find) {
    const auto asset = assets.find(name);
    if (!asset) return refusal(asset.error());
    found.insert_or_assign(name, *asset);
    return Message{Kind::found, {asset->digest.hex(), std::to_string(asset->bytes)}};
  }
  if (asked.kind != Kind::text) return std::nullopt;
  auto text = assets.text(name);
  if (!text) return refusal(text.error());
  text_bytes += text->size();
  return Message{Kind::contents, {std::move(*text)}};
}

std::optional<ReadResult> SceneProcess::read(std::string_view file_name, std::string_view text,
                                             AssetSource& assets, const ReadOptions& options) {
  // The process stops itself after as many seconds, unless a scene has taken it over.
  const TimePoint deadline = clock_.now() + from_seconds(2. * limits_.seconds);
  const Watch watch = [&] {
    if (!is_stopped() && clock_.now() < deadline) return;
    late_ = true;
    kill_ = true;
    ::shutdown(ours_->fd, SHUT_RDWR);  // somebody else may hold their end
  };
  std::size_t text_bytes = text.size();
  {
    Message request{Kind::read, {std::string(file_name), std::string(text)}};
    for (std::string& field : to_fields(options)) request.fields.push_back(std::move(field));
    if (!send(ours_->fd, request, watch)) return std::nullopt;
  }
  Found found;
  const auto most_done = [&] {
    return std::min(kLeastDoneBytes + kDoneBytesPerTextByte * text_bytes, kMostDoneBytes);
  };
  while (auto message = receive(ours_->fd, most_done(), watch)) {
    begun_ = true;
    watch();  // a process that asks without end is late, too
    if (message->kind == Kind::begun) continue;
    if (message->kind != Kind::done) {
      const auto reply = answer(*message, assets, found, text_bytes);
      if (!reply || !send(ours_->fd, *reply, watch)) return std::nullopt;
      continue;
    }
    if (message->fields.empty()) return std::nullopt;
    const std::string json = std::move(message->fields[0]);
    message->fields.erase(message->fields.begin());
    auto diagnostics = to_diagnostics(std::move(message->fields));
    if (!diagnostics) return std::nullopt;
    ReadResult result{std::nullopt, std::move(*diagnostics)};
    if (json.empty()) return result;
    auto scene = deserialize_scene(json);
    if (!scene) return refused(scene.error().message);
    for (const Asset& asset : scene->assets)
      if (const auto known = found.find(asset.name); known == found.end() || known->second != asset)
        return refused("its reader names a file that it did not ask for");
    result.scene = std::move(*scene);
    return result;
  }
  return std::nullopt;
}

Result<std::string> SceneProcess::why() {
  if (is_stopped()) return fail(Errc::unavailable, "the coordinator stops");
  if (!problem_.empty()) return problem_;
  // One that has ended is seen as such at once; another one does not keep to the protocol.
  const bool kept_on = ended_.wait_for(kEndSoon) != std::future_status::ready;
  end();
  const auto ended = ended_.get();
  if (!ended) return tl::unexpected<Error>(ended.error());
  const int status = ended->status;
  if (late_ || (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM))
    return fmt::format("reading it takes more than {} s", limits_.seconds);
  if (kept_on) return "its reader gave no answer";
  if (WIFSIGNALED(status)) return fmt::format("its reader crashed ({})", ::strsignal(WTERMSIG(status)));
  if (WEXITSTATUS(status) == kOutOfMemory)
    return fmt::format("there is not enough memory to read it (it may take {} MiB)",
                       limits_.memory_bytes >> 20);
  return fmt::format("its reader gave no answer and ended with {}", WEXITSTATUS(status));
}

// The processes of one coordinator. One is started before it is needed, so that small scenes do not wait for
// a program to start; one that has read its scenes ends while nobody waits for it.
class SceneProcesses {
 public:
  SceneProcesses(std::filesystem::path program, SceneLimits limits)
      : program_(std::move(program)), limits_(limits) {}

  // Returns the process that is ready, or starts one.
  Result<std::unique_ptr<SceneProcess>> take() {
    const std::lock_guard lock(mutex_);
    std::erase_if(ending_, [](const auto& process) { return process->has_ended(); });
    auto taken = std::move(ready_);
    if (auto next = start()) ready_ = std::move(*next);
    if (taken && !taken->has_ended()) return taken;
    return start();
  }
  Result<std::unique_ptr<SceneProcess>> start() const { return SceneProcess::start(program_, limits_); }

  void end(std::unique_ptr<SceneProcess> process) {
    process->end();
    const std::lock_guard lock(mutex_);
    ending_.push_back(std::move(process));
  }

 private:
  const std::filesystem::path program_;
  const SceneLimits limits_;
  std::mutex mutex_;
  std::unique_ptr<SceneProcess> ready_;
  std::vector<std::unique_ptr<SceneProcess>> ending_;
};

// Reads the scenes of one submission.
class ProcessReader {
 public:
  explicit ProcessReader(std::shared_ptr<SceneProcesses> processes) : processes_(std::move(processes)) {}
  ~ProcessReader() {
    if (process_) processes_->end(std::move(process_));
  }
  ProcessReader(const ProcessReader&) = delete;

  Result<ReadResult> read(std::string_view file_name, std::string_view text, AssetSource& assets,
                          const ReadOptions& options) {
    const bool first = !process_;
    if (first)
      if (auto started = keep(processes_->take()); !started) return tl::unexpected(started.error());
    auto result = process_->read(file_name, text, assets, options);
    if (!result && first && !process_->has_begun() && !process_->is_late()) {
      // It had ended before the scene came.
      if (auto started = keep(processes_->start()); !started) return tl::unexpected(started.error());
      result = process_->read(file_name, text, assets, options);
    }
    if (result) return std::move(*result);
    const auto why = process_->why();
    process_.reset();
    if (!why)
      return fail(why.error().code == Errc::unavailable ? Errc::unavailable : Errc::internal,
                  "no scene can be read: " + why.error().message);
    return fail(Errc::invalid_argument, fmt::format("the scene {} cannot be read: {}", file_name, *why));
  }

 private:
  Result<void> keep(Result<std::unique_ptr<SceneProcess>> started) {
    if (!started) return tl::unexpected(started.error());
    process_ = std::move(*started);
    return {};
  }

  const std::shared_ptr<SceneProcesses> processes_;
  std::unique_ptr<SceneProcess> process_;
};

}  // namespace

OpenReader scenes_by_processes(std::filesystem::path program, SceneLimits limits) {
  return [processes = std::make_shared<SceneProcesses>(std::move(program), limits)]() -> SceneReader {
    return [reader = std::make_shared<ProcessReader>(processes)](
               std::string_view file_name, std::string_view text, AssetSource& assets,
               const ReadOptions& options) { return reader->read(file_name, text, assets, options); };
  };
}

}  // namespace ls
