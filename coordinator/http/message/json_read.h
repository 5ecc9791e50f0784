// Helpers that read request bodies: JSON objects in which unknown keys are errors.
#pragma once

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/base/digest.h"
#include "core/base/error.h"

namespace ls::http {

// Parses JSON of at most kMaxJsonDepth levels; `what` names the text in the error.
Result<nlohmann::json> parse_json(std::string_view text, std::string_view what);

// Parses the body as a JSON object that may have only the keys in `known`. The error explains what is wrong.
Result<nlohmann::json> read_object(std::string_view body, std::initializer_list<std::string_view> known);

// Parses a SHA-256 in hexadecimal digits (either case); `what` names the value in the error.
Result<Digest> read_digest(std::string_view text, std::string_view what);
Result<Digest> read_digest(const nlohmann::json& value, std::string_view what);

// Serialises to JSON; invalid UTF-8 is replaced.
std::string write_json(const nlohmann::ordered_json& json);

}  // namespace ls::http
