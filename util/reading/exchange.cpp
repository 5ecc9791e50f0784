#include "util/reading/exchange.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <string_view>

#include "core/base/parse_number.h"
#include "core/base/safe_text.h"
#include "core/base/text/utf8.h"
#include "core/job/limits.h"
#include "core/scene/limits.h"

namespace ls::reading {
namespace {

struct Head {
  std::uint8_t kind = 0;
  std::uint32_t fields = 0;
};

constexpr std::size_t kDiagnosticFields = 7;
static_assert(kDiagnosticFields * scene::kMaxDiagnostics + 1 <= kMaxFields &&
              3 + 2 * kMaxDefines + 2 <= kMaxFields);

template <class T>
std::optional<T> number(const std::string& text) {
  return parse_number<T>(text);
}

constexpr std::size_t kMostShown = 16 << 10;  // bytes of a text of a diagnostic

// The process may be under control of a scene: what it says of the scene becomes part of answers and logs.
std::string clean(std::string text) {
  text.resize(std::min(text.size(), kMostShown));
  for (std::size_t from = 0;;) {
    const std::size_t at = find_invalid_utf8(std::string_view(text).substr(from));
    if (at == std::string::npos) break;
    text[from += at] = '?';
  }
  return find_control(text) == std::string::npos ? std::move(text) : plain_text(text);
}

// Receives a field piece by piece, so that memory is taken only for bytes that have arrived.
bool receive_field(int fd, std::uint64_t bytes, std::string& out, const Watch& watch) {
  constexpr std::uint64_t kPiece = 1 << 20;
  while (out.size() < bytes) {
    const std::size_t at = out.size();
    out.resize(at + static_cast<std::size_t>(std::min(kPiece, bytes - at)));
    if (!receive_all(fd, out.data() + at, out.size() - at, watch)) return false;
  }
  return true;
}

}  // namespace

bool send(int fd, const Message& message, const Watch& watch) {
  const Head head{static_cast<std::uint8_t>(message.kind), static_cast<std::uint32_t>(message.fields.size())};
  std::string sizes(sizeof head.kind + sizeof head.fields + message.fields.size() * sizeof(std::uint64_t),
                    '\0');
  std::memcpy(sizes.data(), &head.kind, sizeof head.kind);
  std::memcpy(sizes.data() + sizeof head.kind, &head.fields, sizeof head.fields);
  std::size_t at = sizeof head.kind + sizeof head.fields;
  for (const std::string& field : message.fields) {
    const std::uint64_t bytes = field.size();
    std::memcpy(sizes.data() + at, &bytes, sizeof bytes);
    at += sizeof bytes;
  }
  if (!send_all(fd, sizes.data(), sizes.size(), watch)) return false;
  return std::ranges::all_of(message.fields, [&](const std::string& field) {
    return send_all(fd, field.data(), field.size(), watch);
  });
}

std::optional<Message> receive(int fd, std::size_t most, const Watch& watch) {
  Head head;
  if (!receive_all(fd, &head.kind, sizeof head.kind, watch) ||
      !receive_all(fd, &head.fields, sizeof head.fields, watch))
    return std::nullopt;
  if (head.kind > static_cast<std::uint8_t>(Kind::refused) || head.fields > kMaxFields) return std::nullopt;
  std::vector<std::uint64_t> sizes(head.fields);
  if (!receive_all(fd, sizes.data(), sizes.size() * sizeof sizes[0], watch)) return std::nullopt;
  const auto kind = static_cast<Kind>(head.kind);
  const bool is_short = kind != Kind::read && kind != Kind::done && kind != Kind::contents;
  std::uint64_t left = is_short ? kMaxNameBytes : most;
  for (const std::uint64_t bytes : sizes) {
    if (bytes > left) return std::nullopt;
    left -= bytes;
  }
  Message message{kind, std::vector<std::string>(sizes.size())};
  for (std::size_t i = 0; i < sizes.size(); ++i)
    if (!receive_field(fd, sizes[i], message.fields[i], watch)) return std::nullopt;
  return message;
}

std::vector<std::string> to_fields(const ReadOptions& options) {
  std::vector<std::string> fields = {options.strict ? "1" : "0", options.labels ? "1" : "0",
                                     options.frame ? std::to_string(*options.frame) : ""};
  for (const auto& [name, value] : options.defines) fields.insert(fields.end(), {name, value});
  return fields;
}

std::optional<ReadOptions> to_options(std::vector<std::string> fields) {
  if (fields.size() < 3 || fields.size() % 2 != 1) return std::nullopt;
  ReadOptions options{.strict = fields[0] == "1", .labels = fields[1] == "1"};
  if (!fields[2].empty() && !(options.frame = number<std::uint32_t>(fields[2]))) return std::nullopt;
  for (std::size_t i = 3; i < fields.size(); i += 2)
    options.defines.emplace(std::move(fields[i]), std::move(fields[i + 1]));
  return options;
}

std::vector<std::string> to_fields(const std::vector<Diagnostic>& diagnostics) {
  std::vector<std::string> fields;
  for (const Diagnostic& d : diagnostics)
    fields.insert(fields.end(), {d.severity == Diagnostic::Severity::error ? "error" : "warning",
                                 d.place.file, std::to_string(d.place.line), std::to_string(d.place.column),
                                 d.text, d.source_line, std::to_string(d.length)});
  return fields;
}

std::optional<std::vector<Diagnostic>> to_diagnostics(std::vector<std::string> fields) {
  if (fields.size() % kDiagnosticFields != 0 || fields.size() > kDiagnosticFields * scene::kMaxDiagnostics)
    return std::nullopt;
  std::vector<Diagnostic> all;
  for (std::size_t i = 0; i < fields.size(); i += kDiagnosticFields) {
    const std::span<std::string> f = std::span(fields).subspan(i, kDiagnosticFields);
    const auto line = number<int>(f[2]), column = number<int>(f[3]), length = number<int>(f[6]);
    if (!line || !column || !length || *line < 0 || *column < 0) return std::nullopt;
    all.push_back({f[0] == "error" ? Diagnostic::Severity::error : Diagnostic::Severity::warning,
                   {clean(std::move(f[1])), *line, *column},
                   clean(std::move(f[4])),
                   clean(std::move(f[5])),
                   *length});
  }
  return all;
}

Message refusal(const Error& error) {
  return {Kind::refused, {std::to_string(static_cast<int>(error.code)), error.message}};
}

Error to_error(const Message& refused) {
  if (refused.fields.size() != 2) return {Errc::internal, "a refusal has no reason"};
  const auto code = number<unsigned>(refused.fields[0]);
  return {code && *code < kErrcNames.size() ? static_cast<Errc>(*code) : Errc::internal, refused.fields[1]};
}

}  // namespace ls::reading
