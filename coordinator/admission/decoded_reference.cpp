#include "coordinator/admission/decoded_reference.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <memory>

#include "core/base/safe_text.h"
#include "core/image/reference/exchange.h"

namespace ls::coordinator {
namespace {

using reference::Header;
using reference::Outcome;

constexpr int kSeconds = 60;
constexpr std::uint64_t kMemory = std::uint64_t{256} << 20, kMemoryPerPixel = 48;

struct Unmap {
  std::size_t bytes;
  void operator()(std::byte* p) const { ::munmap(p, bytes); }
};
using Mapped = std::unique_ptr<std::byte[], Unmap>;

tl::unexpected<Error> broken(Errc code, const std::string& why) {
  return fail(code, "the reference cannot be decoded: " + why);
}

Result<void> run(const std::filesystem::path& program, const ExrLimits& limits, int shared) {
  const std::uint64_t memory = kMemory + kMemoryPerPixel * limits.max_pixels;
  const auto ended = run_helper(program, {std::to_string(kSeconds), std::to_string(memory)}, shared);
  if (!ended) return broken(Errc::failed_precondition, ended.error().message);
  const int status = ended->status;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM)
    return broken(Errc::invalid_argument, fmt::format("it takes more than {} s", kSeconds));
  return broken(Errc::invalid_argument,
                WIFSIGNALED(status) ? fmt::format("its decoder crashed ({})", ::strsignal(WTERMSIG(status)))
                                    : fmt::format("its decoder ended with {}", WEXITSTATUS(status)));
}

// Takes the result out of the shared memory. The program may have been taken over by the file, so nothing
// that it wrote is trusted.
Result<Reference> result_of(const std::byte* shared, std::size_t values_at, FrameSize size) {
  Header header;
  std::memcpy(&header, shared, sizeof header);
  header.error[sizeof header.error - 1] = header.scene[sizeof header.scene - 1] = 0;
  header.seed[sizeof header.seed - 1] = 0;
  if (header.outcome == Outcome::refused) {
    const bool known = header.code >= 0 && header.code <= static_cast<std::int32_t>(Errc::internal);
    return fail(known ? static_cast<Errc>(header.code) : Errc::invalid_argument, plain_text(header.error));
  }
  if (header.outcome != Outcome::done) return broken(Errc::invalid_argument, "its decoder gave no answer");
  const auto* values = reinterpret_cast<const float*>(shared + values_at);
  const std::size_t count = reference::floats_of(size.width, size.height);
  Reference read{size, {values, values + count}, {}, {header.scene, header.seed}};
  if (header.has_error == 1) read.error.assign(values + count, values + 2 * count);
  const auto finite = [](float value) { return std::isfinite(value); };
  const auto positive = [](float value) { return std::isfinite(value) && value >= 0; };
  if (!std::ranges::all_of(read.rgb, finite) || !std::ranges::all_of(read.error, positive))
    return broken(Errc::invalid_argument, "its decoder gave values that are none");
  return read;
}

}  // namespace

Result<Reference> decode_reference(std::span<const std::byte> exr, FrameSize size, const ExrLimits& limits,
                                   const std::filesystem::path& program) {
  const std::size_t bytes = reference::shared_bytes(exr.size(), size.width, size.height);
  const Descriptor file(::memfd_create("lightshaft-exr", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  // Sealed, since the program could otherwise cut the memory short under this process.
  if (file.fd < 0 || ::ftruncate(file.fd, static_cast<off_t>(bytes)) != 0 ||
      ::fcntl(file.fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    return broken(Errc::resource_exhausted, std::strerror(errno));
  void* mapped = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.fd, 0);
  if (mapped == MAP_FAILED) return broken(Errc::resource_exhausted, std::strerror(errno));
  const Mapped shared(static_cast<std::byte*>(mapped), Unmap{bytes});
  const Header header{.magic = reference::kMagic,
                      .exr_bytes = exr.size(),
                      .max_bytes = limits.max_bytes,
                      .max_pixels = limits.max_pixels,
                      .width = size.width,
                      .height = size.height};
  std::memcpy(shared.get(), &header, sizeof header);
  std::copy(exr.begin(), exr.end(), shared.get() + reference::kExrAt);
  if (const auto ran = run(program, limits, file.fd); !ran) return tl::unexpected(ran.error());
  return result_of(shared.get(), reference::values_at(exr.size()), size);
}

}  // namespace ls::coordinator
