#include "coordinator/http/net/request_head.h"

#include <fmt/format.h>

#include <optional>

#include "coordinator/http/message/message.h"

namespace ls::http {
namespace {

namespace bhttp = beast::http;
using boost::system::error_code;
using Header = bhttp::request_header<bhttp::fields>;

// Headers that a request may have only once. If a header came twice with different values, a proxy might use
// one value and this server the other.
constexpr std::string_view kOnce[] = {"host",           "authorization",     "content-type",
                                      "content-length", "transfer-encoding", "origin",
                                      "expect",         "content-range"};

std::optional<Response> refuse_header(const Header& header) {
  for (const std::string_view name : kOnce)
    if (header.count(name) > 1)
      return problem(400, fmt::format("the request has more than one '{}' header", name));
  if (header.version() != 10 && header.version() != 11) return problem(505, "speak HTTP/1.1 or HTTP/1.0");
  if (header.version() == 11 && header.count(bhttp::field::host) == 0)
    return problem(400, "the request has no 'Host' header");
  if (const auto coding = header[bhttp::field::transfer_encoding];
      !coding.empty() && lower_case(coding) != "chunked")
    return problem(501, "of the transfer codings only 'chunked' is understood");
  if (const auto expect = header[bhttp::field::expect];
      !expect.empty() && lower_case(expect) != "100-continue")
    return problem(400, "of the expectations only '100-continue' is understood");
  if (header.target().size() > kMaxTarget)
    return problem(414, fmt::format("the request target has more than {} characters", kMaxTarget));
  return std::nullopt;
}

}  // namespace

void prepare(Parser& parser, const Limits& limits) {
  parser.header_limit(static_cast<std::uint32_t>(limits.header_bytes));
  parser.body_limit(boost::none);  // no limit here: the limit of the route is applied while the body is read
}

Read read_result(error_code ec, bool timed_out) {
  if (!ec) return Read::ok;
  if (ec == bhttp::error::header_limit) return Read::header_too_large;
  const bool ended = ec == bhttp::error::end_of_stream || ec == bhttp::error::partial_message;
  if (ec.category() == error_code(bhttp::error::end_of_stream).category() && !ended) return Read::malformed;
  return timed_out ? Read::too_slow : Read::closed;
}

std::variant<Response, Request> to_request(const Parser& parser) {
  const Header& header = parser.get();
  if (auto refused = refuse_header(header)) return *refused;
  Request request;
  const auto method = parse_method(std::string_view(header.method_string()));
  if (!method) return problem(501, "this method is not known here");
  request.method = *method;
  if (*method == Method::options && header.target() == "*") return Response{.status = 204};
  auto target = parse_target(std::string_view(header.target()));
  if (!target) return problem(target.error());
  request.segments = std::move(target->segments);
  request.query = std::move(target->query);
  for (const auto& field : header)
    request.headers.emplace_back(lower_case(std::string_view(field.name_string())),
                                 std::string(field.value()));
  if (const auto length = parser.content_length()) request.content_length = *length;
  request.has_body = parser.chunked() || request.content_length.value_or(0) > 0;
  return request;
}

}  // namespace ls::http
