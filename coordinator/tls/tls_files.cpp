#include "coordinator/tls/tls_files.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/bn.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>

#include "core/base/secret.h"
#include "core/base/spawn.h"

namespace ls::tls {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBytes = 1u << 20;

// The certificates of a farm: its own certificate authority, and the certificates that this authority signs.
// All keys are on the curve P-256, and all signatures are ECDSA with SHA-256. Times are seconds since 1970.

struct Certificate {  // texts in PEM format
  std::string cert, key;
};

constexpr std::int64_t kDay = 86'400;
constexpr std::int64_t kAuthorityDays = 3650;
constexpr std::int64_t kDays = 397;  // validity of issued certificates, in days
constexpr std::int64_t kRenewBefore = 30 * kDay;
// Certificates are valid from this many seconds before their issue, since a worker's clock may be slow
constexpr std::int64_t kClocksDiffer = 3600;
constexpr int kSerialBits = 127;

template <auto Free>
struct With {
  template <class T>
  void operator()(T* p) const {
    Free(p);
  }
};
using Key = std::unique_ptr<EVP_PKEY, With<EVP_PKEY_free>>;
using Cert = std::unique_ptr<X509, With<X509_free>>;
using Memory = std::unique_ptr<BIO, With<BIO_free_all>>;
using Number = std::unique_ptr<BIGNUM, With<BN_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, With<X509_EXTENSION_free>>;

struct Pair {
  Cert cert;
  Key key;
};

tl::unexpected<Error> broken(const std::string& what) {
  return fail(Errc::internal, fmt::format("OpenSSL cannot {}", what));
}

std::string text_of(BIO* memory) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(memory, &data);
  return std::string(data, static_cast<std::size_t>(std::max(0L, size)));
}

Result<Certificate> to_pem(const Pair& pair) {
  const Memory cert(BIO_new(BIO_s_mem())), key(BIO_new(BIO_s_mem()));
  if (!cert || !key || PEM_write_bio_X509(cert.get(), pair.cert.get()) != 1 ||
      PEM_write_bio_PKCS8PrivateKey(key.get(), pair.key.get(), nullptr, nullptr, 0, nullptr, nullptr) != 1)
    return broken("write a certificate");
  return Certificate{text_of(cert.get()), text_of(key.get())};
}

Cert read_cert(const std::string& pem) {
  const Memory memory(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  return Cert(memory ? PEM_read_bio_X509(memory.get(), nullptr, nullptr, nullptr) : nullptr);
}

Key read_key(const std::string& pem) {
  const Memory memory(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  const auto no_password = [](char*, int, int, void*) { return 0; };
  return Key(memory ? PEM_read_bio_PrivateKey(memory.get(), nullptr, no_password, nullptr) : nullptr);
}

bool add_extension(X509* cert, X509* issuer, int nid, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, cert, nullptr, nullptr, 0);
  const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, nid, value.c_str()));
  return extension && X509_add_ext(cert, extension.get(), -1) == 1;
}

// Makes a new key and a certificate for it, still without issuer, extensions and signature.
std::optional<Pair> blank(const std::string& common_name, std::int64_t now, std::int64_t days) {
  Pair pair{Cert(X509_new()), Key(EVP_EC_gen("P-256"))};
  const Number serial(BN_new());
  if (!pair.cert || !pair.key || !serial) return std::nullopt;
  X509* x = pair.cert.get();
  X509_NAME* subject = X509_get_subject_name(x);
  const auto name = [&](const char* field, const std::string& value) {
    return X509_NAME_add_entry_by_txt(subject, field, MBSTRING_UTF8,
                                      reinterpret_cast<const unsigned char*>(value.data()),
                                      static_cast<int>(value.size()), -1, 0) == 1;
  };
  const bool done = X509_set_version(x, X509_VERSION_3) == 1 &&
                    BN_rand(serial.get(), kSerialBits, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) == 1 &&
                    BN_to_ASN1_INTEGER(serial.get(), X509_get_serialNumber(x)) != nullptr &&
                    ASN1_TIME_set(X509_getm_notBefore(x), now - kClocksDiffer) != nullptr &&
                    ASN1_TIME_set(X509_getm_notAfter(x), now + days * kDay) != nullptr &&
                    name("O", "Lightshaft") && name("CN", common_name) &&
                    X509_set_pubkey(x, pair.key.get()) == 1;
  return done ? std::optional(std::move(pair)) : std::nullopt;
}

Result<std::string> alternative_names(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) {
    unsigned char bytes[16];
    const bool address =
        ::inet_pton(AF_INET, name.c_str(), bytes) == 1 || ::inet_pton(AF_INET6, name.c_str(), bytes) == 1;
    const auto plain = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
             c == '-' || c == '_' || c == '*';
    };
    if (!address && (name.empty() || name.size() > 253 || !std::all_of(name.begin(), name.end(), plain)))
      return fail(Errc::invalid_argument, fmt::format("'{}' is no host name and no address", name));
    out += fmt::format("{}{}:{}", out.empty() ? "" : ",", address ? "IP" : "DNS", name);
  }
  return out;
}

enum class Use { server, client };
struct Wanted {
  std::string common_name;
  Use use = Use::client;
  std::vector<std::string> names;  // host names and addresses of a server; empty for a client
};

// Makes a new certificate authority, valid for kAuthorityDays from `now` on.
Result<Certificate> make_authority(const std::string& common_name, std::int64_t now) {
  auto pair = blank(common_name, now, kAuthorityDays);
  if (!pair) return broken("make a key");
  X509* x = pair->cert.get();
  const bool done = X509_set_issuer_name(x, X509_get_subject_name(x)) == 1 &&
                    add_extension(x, x, NID_basic_constraints, "critical,CA:TRUE,pathlen:0") &&
                    add_extension(x, x, NID_key_usage, "critical,keyCertSign,cRLSign") &&
                    add_extension(x, x, NID_subject_key_identifier, "hash") &&
                    X509_sign(x, pair->key.get(), EVP_sha256()) != 0;
  if (!done) return broken("sign a certificate");
  return to_pem(*pair);
}

// Makes a key and a certificate for it, signed by `authority` and valid for kDays. invalid_argument: a name
// is invalid, or `authority` is not a certificate with its key.
Result<Certificate> issue(const Certificate& authority, const Wanted& wanted, std::int64_t now) {
  const Cert issuer = read_cert(authority.cert);
  const Key issuer_key = read_key(authority.key);
  if (!issuer || !issuer_key || X509_check_private_key(issuer.get(), issuer_key.get()) != 1)
    return fail(Errc::invalid_argument, "the farm's authority is no certificate with its key");
  const auto names = alternative_names(wanted.names);
  if (!names) return tl::unexpected(names.error());
  auto pair = blank(wanted.common_name, now, kDays);
  if (!pair) return broken("make a key");
  X509* x = pair->cert.get();
  const bool server = wanted.use == Use::server;
  const bool done = X509_set_issuer_name(x, X509_get_subject_name(issuer.get())) == 1 &&
                    add_extension(x, issuer.get(), NID_basic_constraints, "critical,CA:FALSE") &&
                    add_extension(x, issuer.get(), NID_key_usage, "critical,digitalSignature") &&
                    add_extension(x, issuer.get(), NID_ext_key_usage, server ? "serverAuth" : "clientAuth") &&
                    add_extension(x, issuer.get(), NID_subject_key_identifier, "hash") &&
                    add_extension(x, issuer.get(), NID_authority_key_identifier, "keyid") &&
                    (names->empty() || add_extension(x, issuer.get(), NID_subject_alt_name, *names)) &&
                    X509_sign(x, issuer_key.get(), EVP_sha256()) != 0;
  if (!done) return broken("sign a certificate");
  return to_pem(*pair);
}

// True if `cert` was signed by `authority` and is valid at least until the time `until`.
bool is_good(const std::string& cert, const std::string& authority, std::int64_t until) {
  const Cert own = read_cert(cert), issuer = read_cert(authority);
  if (!own || !issuer) return false;
  const Key key(X509_get_pubkey(issuer.get()));
  auto time = static_cast<time_t>(until);
  return key && X509_verify(own.get(), key.get()) == 1 &&
         X509_cmp_time(X509_get0_notAfter(own.get()), &time) > 0;
}

tl::unexpected<Error> wrong(const fs::path& file, const std::string& why) {
  return fail(Errc::invalid_argument, fmt::format("'{}' {}", file.string(), why));
}

Result<std::string> read_pem(const fs::path& file, bool secret) {
  const Descriptor in{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
  struct stat info {};
  if (in.fd < 0 || ::fstat(in.fd, &info) != 0)
    return wrong(file, fmt::format("cannot be read: {}", std::strerror(errno)));
  if (secret && !kept_secret(info.st_uid, info.st_mode, ::geteuid()))
    return wrong(file, "is a key that others may read: chmod 600 it");
  std::string text;
  std::array<char, 4096> buffer{};
  while (true) {
    const ssize_t n = ::read(in.fd, buffer.data(), buffer.size());
    if (n < 0) return wrong(file, fmt::format("cannot be read: {}", std::strerror(errno)));
    if (n == 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(n));
    if (text.size() > kMaxBytes) return wrong(file, "is too large to be a certificate or a key");
  }
}

Result<void> write_pair(const fs::path& folder, const std::string& name, const Certificate& pair) {
  if (auto done = write_private(folder / (name + ".key"), pair.key); !done) return done;
  return write_private(folder / (name + ".pem"), pair.cert, 0644);
}

Result<Certificate> authority_of(const fs::path& folder, std::int64_t now) {
  const bool cert = fs::exists(folder / "ca.pem"), key = fs::exists(folder / "ca.key");
  if (!cert) {  // made even if there is a key: the last start may have ended before it wrote the certificate
    auto made = make_authority("Lightshaft farm", now);
    if (!made) return made;
    if (auto done = write_pair(folder, "ca", *made); !done) return tl::unexpected(done.error());
    return made;
  }
  if (!key)
    return wrong(
        folder / "ca.key",
        "is missing beside ca.pem: put it back, or give certificates of your own with --tls-cert, "
        "--tls-key and --tls-ca, or delete the folder (then all workers and users need the new ca.pem)");
  auto ca = read_pem(folder / "ca.pem", false);
  if (!ca) return tl::unexpected(ca.error());
  auto ca_key = read_pem(folder / "ca.key", true);
  if (!ca_key) return tl::unexpected(ca_key.error());
  return Certificate{std::move(*ca), std::move(*ca_key)};
}

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

}  // namespace

bool kept_secret(unsigned owner, unsigned mode, unsigned reader) {
  return (mode & 077) == 0 || (owner == 0 && reader != 0 && (mode & 037) == 0);
}

Result<Texts> read_files(const fs::path& ca, const fs::path& cert, const fs::path& key) {
  auto own_ca = read_pem(ca, false);
  if (!own_ca) return tl::unexpected(own_ca.error());
  auto own_cert = read_pem(cert, false);
  if (!own_cert) return tl::unexpected(own_cert.error());
  auto own_key = read_pem(key, true);
  if (!own_key) return tl::unexpected(own_key.error());
  return Texts{std::move(*own_ca), std::move(*own_cert), std::move(*own_key)};
}

Result<Texts> make_files(const fs::path& folder, std::vector<std::string> names, std::int64_t now) {
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
    return fail(Errc::resource_exhausted,
                fmt::format("cannot make '{}': {}", folder.string(), std::strerror(errno)));
  const auto authority = authority_of(folder, now);
  if (!authority) return tl::unexpected(authority.error());
  for (const std::string& own :
       {std::string("localhost"), std::string("127.0.0.1"), std::string("::1"), host_name()})
    if (!own.empty()) names.push_back(own);
  const auto server = issue(*authority, {"coordinator", Use::server, std::move(names)}, now);
  if (!server) return tl::unexpected(server.error());
  if (auto done = write_pair(folder, "server", *server); !done) return tl::unexpected(done.error());
  const auto old = read_pem(folder / "worker.pem", false);
  if (!old || !is_good(*old, authority->cert, now + kRenewBefore)) {
    const auto worker = issue(*authority, {"worker", Use::client, {}}, now);
    if (!worker) return tl::unexpected(worker.error());
    if (auto done = write_pair(folder, "worker", *worker); !done) return tl::unexpected(done.error());
  }
  return Texts{authority->cert, server->cert, server->key};
}

}  // namespace ls::tls
