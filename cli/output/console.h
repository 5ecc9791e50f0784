// Output and exit codes of commands. Diagnostics and errors go to stderr, results to stdout.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "coordinator/service/coordinator.h"
#include "core/base/error.h"
#include "core/scene/diagnostic.h"

namespace ls::cli {

enum ExitCode : int { kOk = 0, kFailed = 1, kUsage = 2 };

// usage_error() and print_error() print the error and return the exit code with which the command should end.
int usage_error(const std::string& text);  // returns kUsage
int print_error(const Error& error);       // returns kUsage if the input is at fault, otherwise kFailed
// Prints why a scene or job was rejected, with its diagnostics if any. Returns kUsage if the input is at
// fault, otherwise kFailed.
int print_rejected(const coordinator::Rejected& rejected);

void complain(const std::string& text);  // prints "lightshaft: error: text" to stderr

// Runs `action` and returns its exit code. If it throws, prints the exception's message and returns kFailed.
// `command` is the command's name, for that message.
int run_guarded(const std::string& command, const std::function<int()>& action);

void print_diagnostics(const std::vector<Diagnostic>& diagnostics);
void print_note(const std::string& line);  // prints to stderr; control characters become spaces
void print(const std::string& line);       // prints to stdout, unmodified and flushed

// Returns the rows as lines with aligned columns, each after `indent`, without a newline at the end. The last
// column is not padded.
std::string aligned(const std::vector<std::vector<std::string>>& rows, const std::string& indent = "");

std::string show_bytes(std::uint64_t bytes);  // returns, for example, "3.2 MiB"
std::string show_seconds(double seconds);     // returns, for example, "0.8 s", "42 s", "3:07", "2:05:11"

}  // namespace ls::cli
