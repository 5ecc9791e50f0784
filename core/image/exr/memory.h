// Lets OpenEXR read from memory and write to memory, and checks the headers of a file before OpenEXR reads
// it. Used by the files of this folder only.
#pragma once

#include <ImfIO.h>
#include <ImfThreading.h>
#include <fmt/format.h>

#include <Iex.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <mutex>
#include <new>
#include <span>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/image/exr/exr_file.h"

namespace ls::exr {

class MemoryReader final : public Imf::IStream {
 public:
  MemoryReader(std::span<const std::byte> bytes, const std::string& name)
      : IStream(name.c_str()), bytes_(bytes) {}

  bool read(char c[], int n) override {
    if (n < 0 || static_cast<std::uint64_t>(n) > bytes_.size() - position_)
      throw Iex::InputExc("the file ends too early");
    std::memcpy(c, bytes_.data() + position_, static_cast<std::size_t>(n));
    position_ += static_cast<std::uint64_t>(n);
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override {
    if (position > bytes_.size()) throw Iex::InputExc("the file ends too early");
    position_ = position;
  }

 private:
  std::span<const std::byte> bytes_;
  std::uint64_t position_ = 0;
};

class MemoryWriter final : public Imf::OStream {
 public:
  MemoryWriter() : OStream("memory") {}

  void write(const char c[], int n) override {
    const auto end = position_ + static_cast<std::uint64_t>(n);
    if (end > bytes_.size()) bytes_.resize(end);
    // memcpy must not be called for an empty text, whose address may be null
    if (n > 0) std::memcpy(bytes_.data() + position_, c, static_cast<std::size_t>(n));
    position_ = end;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
  std::uint64_t position_ = 0;
};

// Keeps the library from starting threads: the farm assigns threads itself, and small images would gain
// nothing.
inline void set_up_library() {
  static std::once_flag once;
  std::call_once(once, [] { Imf::setGlobalThreadCount(0); });
}

// Calls f, which returns a Result<T>. If the library throws an exception, returns an error with the code
// `code` and the message `what: reason`.
template <class F>
auto guarded(Errc code, const std::string& what, F&& f) -> decltype(f()) {
  try {
    set_up_library();
    return f();
  } catch (const std::bad_alloc&) {
    return fail(Errc::resource_exhausted, fmt::format("{}: out of memory", what));
  } catch (const std::exception& e) {
    return fail(code, fmt::format("{}: {}", what, e.what()));
  } catch (...) {
    return fail(Errc::internal, fmt::format("{}: unknown exception", what));
  }
}

// Checks an EXR's headers before the library reads the file. The library allocates tables, buffers and
// strings of the sizes that the headers claim, and a file of a few hundred bytes can claim terabytes. The
// function checks that the size of every part is within `limits`, that every attribute lies inside the file
// and is as long as its type requires, that every chunk table fits into the file, and that the buffer of one
// chunk has at most 2^30 bytes. The library checks everything else.
Result<void> check_headers(std::span<const std::byte> file, const std::string& name, const ExrLimits& limits);

}  // namespace ls::exr
