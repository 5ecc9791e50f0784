#include "coordinator/tls/certificates.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <openssl/bn.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <memory>
#include <optional>

namespace ls::tls {
namespace {

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

}  // namespace

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

bool is_good(const std::string& cert, const std::string& authority, std::int64_t until) {
  const Cert own = read_cert(cert), issuer = read_cert(authority);
  if (!own || !issuer) return false;
  const Key key(X509_get_pubkey(issuer.get()));
  auto time = static_cast<time_t>(until);
  return key && X509_verify(own.get(), key.get()) == 1 &&
         X509_cmp_time(X509_get0_notAfter(own.get()), &time) > 0;
}

}  // namespace ls::tls
