#include "util/denoise/denoiser.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "core/base/check.h"
#include "core/base/safe_text.h"
#include "util/denoise/exchange.h"

namespace ls {
namespace {

using denoise::Header;
using denoise::Outcome;

constexpr const char* kSoname = "libOpenImageDenoise.so.2";
constexpr int kSecondsToLoad = 600;

std::string library_path() {
  const char* given = std::getenv("LIGHTSHAFT_OIDN");
  std::error_code ignored;
  const std::filesystem::path asked(given ? given : "");
  const std::vector<std::filesystem::path> places =
      asked.empty() ? std::vector{program_beside_us("oidn/lib"), program_beside_us("../../oidn/lib")}
                    : std::vector{asked, asked / "lib"};
  for (const auto& place : places)
    if (std::filesystem::exists(place / kSoname, ignored)) return (place / kSoname).string();
  return asked.empty() ? kSoname : asked.string();
}

tl::unexpected<Error> broken(const std::string& why, Errc code = Errc::internal) {
  return fail(code, "cannot denoise: " + why);
}

struct Unmap {
  std::size_t bytes;
  void operator()(std::byte* p) const { ::munmap(p, bytes); }
};

// The memory that is shared with the helper program.
class Shared {
 public:
  static Result<Shared> of(FrameSize size, std::size_t images) {
    Shared out;
    out.bytes_ = denoise::shared_bytes(size.width, size.height, static_cast<std::int32_t>(images));
    out.file_ =
        std::make_unique<Descriptor>(::memfd_create("lightshaft-denoise", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    // The seals keep the helper from cutting the memory short: reading it here would then kill this process.
    if (out.file_->fd < 0 || ::ftruncate(out.file_->fd, static_cast<off_t>(out.bytes_)) != 0 ||
        ::fcntl(out.file_->fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
      return broken(std::strerror(errno), Errc::resource_exhausted);
    void* mapped = ::mmap(nullptr, out.bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, out.file_->fd, 0);
    if (mapped == MAP_FAILED) return broken(std::strerror(errno), Errc::resource_exhausted);
    out.mapped_ = std::unique_ptr<std::byte[], Unmap>(static_cast<std::byte*>(mapped), Unmap{out.bytes_});
    Header& header = out.header();
    header.magic = denoise::kMagic;
    header.width = size.width;
    header.height = size.height;
    header.images = static_cast<std::int32_t>(images);
    return out;
  }
  int fd() const { return file_->fd; }
  Header& header() { return *reinterpret_cast<Header*>(mapped_.get()); }
  float* plane(std::size_t image, std::size_t plane, std::size_t floats) {
    return reinterpret_cast<float*>(mapped_.get() + denoise::kPlanesAt) +
           (image * denoise::kPlanesPerImage + plane) * floats;
  }

 private:
  std::size_t bytes_ = 0;
  std::unique_ptr<Descriptor> file_;
  std::unique_ptr<std::byte[], Unmap> mapped_{nullptr, Unmap{0}};
};

Result<void> run(const std::filesystem::path& program, const std::string& library, int threads, int seconds,
                 Shared& shared) {
  const auto ended =
      run_helper(program, {library, std::to_string(threads), std::to_string(seconds)}, shared.fd());
  if (!ended) return broken(ended.error().message);
  const int status = ended->status;
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM)
    return broken(fmt::format("{} was ended after {} s: the library hangs, or this machine is overloaded",
                              program.filename().string(), seconds),
                  Errc::resource_exhausted);
  if (WIFSIGNALED(status))
    return broken(
        fmt::format("{} was killed ({}){}", program.filename().string(), ::strsignal(WTERMSIG(status)),
                    WTERMSIG(status) == SIGKILL ? ": is there enough memory?" : ""),
        WTERMSIG(status) == SIGKILL ? Errc::resource_exhausted : Errc::internal);
  if (WEXITSTATUS(status) != 0)
    return broken(fmt::format("{} ended with code {}{}{}", program.filename().string(), WEXITSTATUS(status),
                              ended->last_line.empty() ? "" : ": ", ended->last_line));
  const Header& header = shared.header();
  // The text need not end with a zero, and other processes may still change it.
  if (header.outcome != Outcome::done)
    return broken(plain_text({header.error, ::strnlen(header.error, sizeof header.error)}));
  return {};
}

}  // namespace

Result<Denoiser> Denoiser::find(int threads, const std::string& library, const std::filesystem::path& program,
                                int least_seconds) {
  Denoiser out;
  out.program_ = program;
  out.library_ = library.empty() ? library_path() : library;
  out.threads_ = std::max(1, threads);
  out.least_seconds_ = least_seconds;
  auto shared = Shared::of({0, 0}, 0);
  if (!shared) return tl::unexpected(shared.error());
  if (const auto ran = run(program, out.library_, out.threads_, kSecondsToLoad, *shared); !ran) {
    if (ran.error().code != Errc::internal || shared->header().version != 0)
      return tl::unexpected(ran.error());
    return fail(Errc::failed_precondition,
                fmt::format("Open Image Denoise is not usable on this machine ({}). Install it with "
                            "deploy/install-denoiser.sh, or set LIGHTSHAFT_OIDN to the folder of {}",
                            ran.error().message, kSoname));
  }
  const int version = shared->header().version;
  out.name_ = fmt::format("Open Image Denoise {}.{}.{}", version / 10000, version / 100 % 100, version % 100);
  return out;
}

int Denoiser::most_seconds(FrameSize size, std::size_t images) const {
  constexpr std::uint64_t kPixelsPerSecond = 10'000;
  return static_cast<int>(static_cast<std::uint64_t>(least_seconds_) +
                          size.pixels() * images / kPixelsPerSecond);
}

Result<std::vector<std::vector<float>>> Denoiser::denoise(FrameSize size,
                                                          std::span<const NoisyImage> images) const {
  const std::size_t floats = denoise::plane_floats(size.width, size.height);
  auto shared = Shared::of(size, images.size());
  if (!shared) return tl::unexpected(shared.error());
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::vector<float>* planes[] = {&images[i].color, &images[i].albedo, &images[i].normal};
    for (std::size_t p = 0; p < denoise::kPlanesPerImage; ++p) {
      CHECK(planes[p]->size() == floats, "a plane of {} floats in an image of {} x {}", planes[p]->size(),
            size.width, size.height);
      std::copy(planes[p]->begin(), planes[p]->end(), shared->plane(i, p, floats));
    }
  }
  const int seconds = most_seconds(size, images.size());
  if (const auto ran = run(program_, library_, threads_, seconds, *shared); !ran)
    return tl::unexpected(ran.error());
  std::vector<std::vector<float>> out;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const float* from = shared->plane(i, 0, floats);
    out.emplace_back(from, from + floats);
    if (!std::all_of(out.back().begin(), out.back().end(), [](float v) { return std::isfinite(v); }))
      return broken("the library returned values that are not finite");
  }
  return out;
}

}  // namespace ls
