// Output and exit codes of commands. Diagnostics and errors go to stderr, answers to stdout.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/scene/diagnostic.h"
#include "coordinator/service/coordinator.h"

namespace ls::cli {

enum ExitCode : int { kOk = 0, kFailed = 1, kUsage = 2 };

// Each prints what is wrong and returns the command's exit code.
int usage_error(const std::string& text);  // kUsage
int print_error(const Error& error);       // kUsage if the input is at fault, otherwise kFailed
// For a rejected scene or job, with its diagnostics if any. kUsage if the input is at fault, otherwise
// kFailed.
int print_rejected(const coordinator::Rejected& rejected);

void complain(const std::string& text);  // "lightshaft: error: text" to stderr

// Returns the action's exit code; prints an exception and returns kFailed.
int run_guarded(const std::string& command, const std::function<int()>& action);

void print_diagnostics(const std::vector<Diagnostic>& diagnostics);
void print_note(const std::string& line);  // to stderr, as plain_text()
void print(const std::string& line);       // to stdout, unmodified and flushed

std::string show_bytes(std::uint64_t bytes);  // "3.2 MiB"
std::string show_seconds(double seconds);     // "0.8 s", "42 s", "3:07", "2:05:11"

}  // namespace ls::cli
