// The interface of blob stores. Blobs are files (scenes and their assets), stored by digest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"

namespace ls::coordinator {

// Stores blobs (files as plain bytes) under their SHA-256 digests. put() and Upload::finish() verify the
// digest, and a blob can be seen only when it is complete. The bytes of a damaged blob are not returned: see
// prove().
class BlobStore {
 public:
  virtual ~BlobStore() = default;
  virtual bool has(const Digest& digest) const = 0;
  // Like has(), but returns an error if the storage is unavailable, so that the answer is not known.
  virtual Result<bool> find(const Digest& digest) const { return has(digest); }
  // Returns those of the digests whose blobs the store lacks, in the given order. A remote store needs fewer
  // requests for this than for one find() per digest. Returns the same errors as find().
  virtual Result<std::vector<Digest>> missing(std::span<const Digest> digests) const {
    std::vector<Digest> lacking;
    for (const Digest& digest : digests) {
      const auto there = find(digest);
      if (!there) return tl::unexpected(there.error());
      if (!*there) lacking.push_back(digest);
    }
    return lacking;
  }
  // Returns an error if the storage (a disk or another machine) is unavailable. Sends it one request, which
  // may take seconds.
  virtual Result<void> answers() const { return {}; }
  // Verifies that the blob exists and that its bytes match its digest. Each process reads the blob for this
  // only once; it reads it again if the file has changed since, or if `again` is set (because a reader got
  // wrong bytes). not_found: there is no such blob. failed_precondition: the blob is damaged; it has been
  // moved aside and counts as missing.
  virtual Result<void> prove(const Digest& digest, [[maybe_unused]] bool again = false) const {
    return has(digest) ? Result<void>()
                       : fail(Errc::not_found, std::string("there is no blob ").append(digest.hex()));
  }
  virtual Result<std::uint64_t> size(const Digest& digest) const = 0;
  // Returns up to `length` bytes from `offset` on, and at most limits::kMaxBlobRead; fewer at the blob's end.
  virtual Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                              std::uint64_t length) const = 0;
  // Returns the first `bytes` bytes of the blob, or all bytes of a shorter blob. Calls read() as often as
  // needed.
  Result<std::vector<std::byte>> read_whole(const Digest& digest, std::uint64_t bytes) const {
    auto whole = read(digest, 0, bytes);
    while (whole && whole->size() < bytes) {
      const auto piece = read(digest, whole->size(), bytes - whole->size());
      if (!piece) return piece;
      if (piece->empty()) break;
      whole->insert(whole->end(), piece->begin(), piece->end());
    }
    return whole;
  }
  virtual Result<void> put(const Digest& digest, std::span<const std::byte> bytes) = 0;
  // Receives a blob piece by piece, in order; finish() verifies the digest. If the Upload is destroyed before
  // finish(), its bytes are dropped, unless it came from resume_upload().
  class Upload {
   public:
    virtual ~Upload() = default;
    virtual Result<void> append(std::span<const std::byte> bytes) = 0;
    virtual Result<void> finish() = 0;
  };
  virtual Result<std::unique_ptr<Upload>> begin_upload(const Digest& digest) = 0;

  // Uploads in parts: an upload that can be continued after a broken connection

  // Returns how many bytes of an incomplete blob the store has received.
  virtual std::uint64_t received(const Digest&) const { return 0; }
  // Continues an incomplete blob after its first `offset` bytes. failed_precondition: `offset` is not
  // received(). Appended bytes are kept if the Upload is destroyed before finish(), even over restarts. Bytes
  // from an earlier Upload of the same blob are rejected from now on: the client has reconnected, so its
  // earlier connection is dead, even if the server has not noticed it yet.
  virtual Result<std::unique_ptr<Upload>> resume_upload(const Digest&, std::uint64_t) {
    return fail(Errc::unavailable, "this store takes no uploads in parts");
  }

  // Collection of unused blobs

  // Returns the digests of all complete blobs or, if the argument is true, of all incomplete ones.
  virtual Result<std::vector<Digest>> list(bool) const { return std::vector<Digest>{}; }
  virtual Result<void> remove(const Digest&) { return {}; }
  virtual void remove_unfinished(const Digest&) {}
};

}  // namespace ls::coordinator
