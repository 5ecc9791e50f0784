// lightshaft-scene SECONDS BYTES: reads scene files that strangers have sent, and answers over the inherited
// socket kHelperFd (exchange.h) until it is closed. The readers may have bugs: so the program shuts itself in
// first. It is killed after SECONDS for one scene, and may take BYTES of memory.
//
// lightshaft-scene SECONDS BYTES OUTPUT FOLDER... -- PROGRAM ARGUMENT...: shuts itself in, and becomes a
// program that reads scene files of a kind that is read in another language (stages of USD). The program may
// read what is in the FOLDERs, and write OUTPUT bytes to the inherited file kHelperFd.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <new>
#include <string>
#include <string_view>

#include "core/base/digest.h"
#include "core/base/helper_program.h"
#include "core/base/parse_number.h"
#include "core/base/spawn.h"
#include "core/scene/json/serialize.h"
#include "formats/read.h"
#include "util/reading/exchange.h"
#include "util/sandbox/sandbox.h"

namespace {

using ls::reading::Kind;
using ls::reading::Message;

// The files that the scene names: the program that has started us knows them.
class AskedAssets final : public ls::AssetSource {
 public:
  ls::Result<ls::Asset> find(std::string_view name) override {
    const auto reply = ask(Kind::find, name, Kind::found, 2);
    if (!reply) return tl::unexpected<ls::Error>(reply.error());
    const auto digest = ls::Digest::parse(reply->fields[0]);
    const auto bytes = ls::parse_number<std::uint64_t>(reply->fields[1]);
    if (!digest || !bytes) ::_exit(2);
    return ls::Asset{std::string(name), *digest, *bytes};
  }
  ls::Result<std::string> text(std::string_view name) override {
    auto reply = ask(Kind::text, name, Kind::contents, 1);
    if (!reply) return tl::unexpected<ls::Error>(reply.error());
    return std::move(reply->fields[0]);
  }

 private:
  static ls::Result<Message> ask(Kind kind, std::string_view name, Kind expected, std::size_t fields) {
    if (name.size() >= ls::reading::kMaxNameBytes)
      return ls::fail(ls::Errc::not_found, "a name of so many bytes is that of no file");
    if (!ls::reading::send(ls::kHelperFd, {kind, {std::string(name)}})) ::_exit(2);
    auto reply = ls::reading::receive(ls::kHelperFd);
    if (reply && reply->kind == Kind::refused) return tl::unexpected(ls::reading::to_error(*reply));
    if (!reply || reply->kind != expected || reply->fields.size() != fields) ::_exit(2);
    return std::move(*reply);
  }
};

// Reads the scene of a request. False: the channel is closed.
bool serve(Message request) {
  if (request.kind != Kind::read || request.fields.size() < 2) ::_exit(2);
  const auto options = ls::reading::to_options({request.fields.begin() + 2, request.fields.end()});
  if (!options) ::_exit(2);
  if (!ls::reading::send(ls::kHelperFd, {Kind::begun, {}})) return false;
  AskedAssets assets;
  const ls::ReadResult read = ls::read_scene(request.fields[0], request.fields[1], assets, *options);
  Message done{Kind::done, {read.scene ? ls::serialize(*read.scene) : std::string()}};
  for (std::string& field : ls::reading::to_fields(read.diagnostics)) done.fields.push_back(std::move(field));
  return ls::reading::send(ls::kHelperFd, done);
}

// Returns the exit code, and only if the program cannot be started.
int become(ls::ShutInProgram program, char** word, char** end) {
  char** const dashes = std::find(word, end, std::string_view("--"));
  const auto output = word == end ? std::nullopt : ls::parse_number<std::uint64_t>(*word);
  if (!output || end - dashes < 2) return 2;
  program.file_bytes = *output;
  program.readable.assign(word + 1, dashes);
  program.arguments.assign(dashes + 1, end);
  const int reason = ls::become_shut_in(std::move(program));
  std::fprintf(stderr, "%s cannot be started: %s\n", dashes[1], std::strerror(reason));
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return ls::answer_person("lightshaft-scene", LIGHTSHAFT_VERSION, argc, argv);
  const auto seconds = ls::parse_number<unsigned>(argv[1]);
  const auto bytes = ls::parse_number<std::uint64_t>(argv[2]);
  if (!seconds || !bytes) return 2;
  if (argc > 3) return become({.seconds = *seconds, .memory_bytes = *bytes}, argv + 3, argv + argc);
  ls::shut_in_helper(*bytes);
  try {
    while (auto request = ls::reading::receive(ls::kHelperFd)) {
      ::alarm(*seconds);
      if (!serve(std::move(*request))) break;
      ::alarm(0);
    }
  } catch (const std::bad_alloc&) {
    return ls::reading::kOutOfMemory;
  }
  return 0;
}
