// The parser of a request, which is Boost.Beast's, and the conversion of what it parsed to our own types.
// None of it needs a socket. Includes Boost: only the files of the server loop (and their fuzzer) may include
// this header.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/basic_dynamic_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <variant>

#include "coordinator/http/message/limits.h"
#include "coordinator/http/message/message.h"

namespace ls::http {

namespace beast = boost::beast;
// The body has the bytes that have been read and not yet been taken out of it.
using Parser = beast::http::request_parser<beast::http::basic_dynamic_body<beast::flat_buffer>>;

// Applies the limits to a new parser.
void prepare(Parser& parser, const Limits& limits);

enum class Read { ok, closed, too_slow, malformed, header_too_large };
// Returns what the error of a read means; `timed_out` if the read was cancelled by its deadline.
Read read_result(boost::system::error_code ec, bool timed_out);

// Converts the parsed header to a Request without a body. Returns a response instead if the header is
// invalid.
std::variant<Response, Request> to_request(const Parser& parser);

}  // namespace ls::http
