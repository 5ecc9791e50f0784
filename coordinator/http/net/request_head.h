// The parser of requests (that of Boost.Beast), and the conversion of a parsed header to our own types,
// without sockets. Includes Boost: only the files of the server loop (and their fuzzer) may include this
// header.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/basic_dynamic_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <variant>

#include "coordinator/http/message/limits.h"
#include "coordinator/http/message/message.h"

namespace ls::http {

namespace beast = boost::beast;
// The parser of one request. Its buffer body() holds the bytes of the body that have arrived and that its
// user has not removed yet.
using Parser = beast::http::request_parser<beast::http::basic_dynamic_body<beast::flat_buffer>>;

// Sets a new parser's limit on the header. The body gets no limit here.
void prepare(Parser& parser, const Limits& limits);

enum class Read { ok, closed, too_slow, malformed, header_too_large };
// Classifies the error code of a read. `timed_out`: the deadline passed, and the read was cancelled.
Read read_result(boost::system::error_code ec, bool timed_out);

// Converts the parsed header to a Request without a body. Returns a response instead if the header is
// invalid.
std::variant<Response, Request> to_request(const Parser& parser);

}  // namespace ls::http
