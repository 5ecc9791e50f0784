// Files by digest: scenes and their assets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"

namespace ls::coordinator {

// Bytes by digest. put() verifies them; a blob is visible only when complete. Damaged blobs are never read:
// see prove().
class BlobStore {
 public:
  virtual ~BlobStore() = default;
  virtual bool has(const Digest& digest) const = 0;
  // As has(), but with an error if the store cannot tell at the moment.
  virtual Result<bool> find(const Digest& digest) const { return has(digest); }
  // Error if the storage does not answer. Asks once; may take seconds.
  virtual Result<void> answers() const { return {}; }
  // Verifies that the blob exists and its bytes have its digest: reads it once per process, and after its
  // file has changed or, if a reader has found it wrong, with `again`. not_found; failed_precondition: it was
  // damaged; it has been moved aside and counts as missing.
  virtual Result<void> prove(const Digest& digest, [[maybe_unused]] bool again = false) const {
    return has(digest) ? Result<void>()
                       : fail(Errc::not_found, std::string("there is no blob ").append(digest.hex()));
  }
  virtual Result<std::uint64_t> size(const Digest& digest) const = 0;
  virtual Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                              std::uint64_t length) const = 0;
  virtual Result<void> put(const Digest& digest, std::span<const std::byte> bytes) = 0;
  // Streaming upload: append in order; finish() verifies the digest. An abandoned upload leaves nothing
  // behind.
  class Upload {
   public:
    virtual ~Upload() = default;
    virtual Result<void> append(std::span<const std::byte> bytes) = 0;
    virtual Result<void> finish() = 0;
  };
  virtual Result<std::unique_ptr<Upload>> begin_upload(const Digest& digest) = 0;

  // Uploads in parts

  // Number of bytes kept of an incomplete blob.
  virtual std::uint64_t received(const Digest&) const { return 0; }
  // Continues behind the bytes received; failed_precondition: `offset` is not received(). Appended bytes are
  // kept if the upload is destroyed before finish(), even over restarts. From now on an earlier upload in
  // parts of the same blob is rejected: its connection has broken, but that has not been noticed yet.
  virtual Result<std::unique_ptr<Upload>> resume_upload(const Digest&, std::uint64_t) {
    return fail(Errc::unavailable, "this store takes no uploads in parts");
  }

  // Collection of unused blobs

  // Lists all blobs, or (true) all incomplete ones.
  virtual Result<std::vector<Digest>> list(bool) const { return std::vector<Digest>{}; }
  virtual Result<void> remove(const Digest&) { return {}; }
  virtual void remove_unfinished(const Digest&) {}
};

// Checks the value of --blobs: a folder, or an s3:// address with keys in the environment.
Result<void> check_blobs(const std::string& where);

}  // namespace ls::coordinator
