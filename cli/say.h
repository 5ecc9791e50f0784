// What commands say and return. Diagnostics and errors go to stderr, answers to stdout.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/scene/diagnostic.h"
#include "coordinator/service.h"

namespace ls::cli {

enum ExitCode : int { kOk = 0, kFailed = 1, kUsage = 2 };

// Each says what is wrong and returns the command's exit code.
int usage_error(const std::string& text);  // kUsage
int say_error(const Error& error);         // kUsage if the input is at fault, else kFailed
// A scene or job that was refused, with its diagnostics if it has some. kUsage unless it is not the input's
// fault.
int say_rejected(const coordinator::Rejected& rejected);

void complain(const std::string& text);  // "lightshaft: error: text" to stderr

// The action's exit code; an exception is told and is kFailed.
int run_guarded(const std::string& command, const std::function<int()>& action);

void say_diagnostics(const std::vector<Diagnostic>& diagnostics);
void say(const std::string& line);    // to stderr, as plain_text()
void print(const std::string& line);  // to stdout, at once, as it is

std::string show_bytes(std::uint64_t bytes);  // "3.2 MiB"
std::string show_seconds(double seconds);     // "0.8 s", "42 s", "3:07", "2:05:11"

}  // namespace ls::cli
