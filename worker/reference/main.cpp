// lightshaft-exr SECONDS BYTES: decodes the reference image in the inherited file kHelperFd (exchange.h) and
// exits. A user sent the file, and the library that reads it may have bugs: so the program shuts itself in
// first. It is killed after SECONDS, and may take BYTES of memory.
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <new>
#include <string>

#include "core/base/helper_program.h"
#include "core/base/parse_number.h"
#include "core/base/spawn.h"
#include "core/image/reference/exchange.h"
#include "core/image/reference/reference.h"
#include "util/sandbox/sandbox.h"

namespace {

using ls::reference::Header;
using ls::reference::Outcome;

template <std::size_t N>
void put(char (&to)[N], const std::string& text) {
  if (text.size() < N) std::memcpy(to, text.c_str(), text.size() + 1);
}

void refuse(Header& header, ls::Errc code, const std::string& why) {
  header.code = static_cast<std::int32_t>(code);
  put(header.error, why.substr(0, sizeof header.error - 1));
  header.outcome = Outcome::refused;
}

void decode(std::byte* shared) {
  Header& header = *reinterpret_cast<Header*>(shared);
  const Header asked = header;
  try {
    const ls::ExrLimits limits{.max_bytes = asked.max_bytes, .max_pixels = asked.max_pixels};
    const auto read = ls::read_reference({shared + ls::reference::kExrAt, asked.exr_bytes}, "the reference",
                                         {asked.width, asked.height}, limits);
    if (!read) return refuse(header, read.error().code, read.error().message);
    auto* values = reinterpret_cast<float*>(shared + ls::reference::values_at(asked.exr_bytes));
    std::copy(read->rgb.begin(), read->rgb.end(), values);
    std::copy(read->error.begin(), read->error.end(), values + read->rgb.size());
    header.has_error = read->error.empty() ? 0 : 1;
    put(header.scene, read->origin.scene);
    put(header.seed, read->origin.seed);
    header.outcome = Outcome::done;
  } catch (const std::bad_alloc&) {
    refuse(header, ls::Errc::invalid_argument,
           "the reference takes more memory to decode than its size needs");
  } catch (const std::exception& e) {
    refuse(header, ls::Errc::invalid_argument, fmt::format("the reference cannot be decoded: {}", e.what()));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return ls::answer_person("lightshaft-exr", LIGHTSHAFT_VERSION, argc, argv);
  const auto seconds = ls::parse_number<unsigned>(argv[1]);
  const auto bytes = ls::parse_number<std::uint64_t>(argv[2]);
  struct stat info {};
  if (!seconds || !bytes || ::fstat(ls::kHelperFd, &info) != 0) return 2;
  const auto size = static_cast<std::size_t>(info.st_size);
  if (size < ls::reference::kExrAt) return 2;
  void* mapped = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, ls::kHelperFd, 0);
  if (mapped == MAP_FAILED) return 2;
  const Header asked = *static_cast<const Header*>(mapped);
  if (asked.magic != ls::reference::kMagic || asked.exr_bytes > size ||
      ls::reference::shared_bytes(asked.exr_bytes, asked.width, asked.height) > size)
    return 2;
  ::alarm(*seconds);
  ls::shut_in_helper(*bytes);
  decode(static_cast<std::byte*>(mapped));
  return 0;
}
