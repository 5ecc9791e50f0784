#include "util/sandbox/sandbox.h"

#include <fcntl.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <system_error>

#include "core/base/spawn.h"
#include "util/sandbox/call_filter.h"

namespace ls {
namespace {

// kRead and kWrite are access rights of Landlock's ABI 1 (Linux 5.13); later ABIs have more.
constexpr std::uint64_t kRead = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t kWrite = LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_DIR |
                                 LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_CHAR |
                                 LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG |
                                 LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO |
                                 LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_MAKE_SYM;
// The right to truncate files; since ABI 3 (Linux 6.2)
constexpr std::uint64_t kTruncate = std::uint64_t{1} << 14;
constexpr std::uint64_t kFileRights =  // rights that apply to files; the rest apply to folders
    LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_EXECUTE | kTruncate;

// Adds a rule that allows `rights` for the file `path`, or for everything in the folder `path`. A path that
// does not exist needs no rule, so the result is then true.
bool allow(int rules, const std::filesystem::path& path, std::uint64_t rights) {
  const Descriptor place{::open(path.c_str(), O_PATH | O_CLOEXEC)};
  struct stat info {};
  if (place.fd < 0 || ::fstat(place.fd, &info) != 0) return true;
  if (!S_ISDIR(info.st_mode)) rights &= kFileRights;
  const landlock_path_beneath_attr rule{rights, place.fd};
  return ::syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
}

// The kernel's landlock_ruleset_attr, including fields that are newer than the kernel headers of the build.
struct Ruleset {
  std::uint64_t files = 0;    // file rights that are denied unless a rule allows them; since ABI 1
  std::uint64_t network = 0;  // the same for network rights; always 0 here; since ABI 4
  std::uint64_t scoped = 0;   // actions limited to processes in the sandbox; since ABI 6
};
// A bit of Ruleset::scoped: the process can send signals only to processes within the sandbox. This also
// holds for signals that the kernel sends on its behalf (fcntl with F_SETOWN).
constexpr std::uint64_t kScopeSignal = 2;

bool bound_files(const std::vector<std::filesystem::path>& readable, const std::filesystem::path& program) {
  const long abi = ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (abi < 1) return false;
  Ruleset attr;
  attr.files = kRead | kWrite | LANDLOCK_ACCESS_FS_EXECUTE | (abi >= 3 ? kTruncate : 0);
  attr.scoped = abi >= 6 ? kScopeSignal : 0;
  const std::size_t known = abi >= 6 ? sizeof attr : sizeof attr.files;
  const Descriptor rules{static_cast<int>(::syscall(SYS_landlock_create_ruleset, &attr, known, 0))};
  if (rules.fd < 0) return false;
  bool done = true;
  std::error_code error;
  const auto own = std::filesystem::read_symlink("/proc/self/exe", error);
  constexpr std::uint64_t kRun = kRead | LANDLOCK_ACCESS_FS_EXECUTE;
  for (const char* folder : {"/usr", "/lib", "/lib64"}) done &= allow(rules.fd, folder, kRun);
  // This program and the OpenVDB reader beside it are allowed, but not the folder that contains them.
  done &= allow(rules.fd, own, kRun);
  done &= allow(rules.fd, own.parent_path() / "lightshaft-vdb", kRun);
  // In a wheel (deploy/wheel.sh) the reader's libraries lie in this folder.
  done &= allow(rules.fd, own.parent_path() / "lightshaft-libraries", kRun);
  // The dynamic loader and the thread library read these files and folders. Nothing in /proc about other
  // processes is among them.
  for (const char* path : {"/etc/ld.so.cache", "/etc/ld.so.preload", "/sys", "/proc/self", "/proc/cpuinfo",
                           "/proc/meminfo", "/proc/sys/vm", "/dev/urandom", "/dev/random"})
    done &= allow(rules.fd, path, kRead);
  done &= allow(rules.fd, "/dev/null", kRead | LANDLOCK_ACCESS_FS_WRITE_FILE);
  for (const auto& folder : readable) done &= allow(rules.fd, folder, kRead);
  if (!program.empty()) done &= allow(rules.fd, program, kRun);
  return done && ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::syscall(SYS_landlock_restrict_self, rules.fd, 0) == 0;
}

// Gives up all capabilities, also those that a program would get when it is started by root. Without
// capabilities this fails only if there is nothing to give up. A filter that the process was started with,
// such as that of a systemd unit, may deny capset(): then it is enough that there are none.
bool drop_capabilities() {
  for (unsigned long one = 0; ::prctl(PR_CAPBSET_READ, one, 0, 0, 0) >= 0; ++one)
    ::prctl(PR_CAPBSET_DROP, one, 0, 0, 0);
  ::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0);
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  const __user_cap_data_struct none[_LINUX_CAPABILITY_U32S_3]{};
  if (::syscall(SYS_capset, &header, none) == 0) return true;
  __user_cap_data_struct held[_LINUX_CAPABILITY_U32S_3]{};
  return ::syscall(SYS_capget, &header, held) == 0 &&
         std::all_of(std::begin(held), std::end(held), [](const __user_cap_data_struct& one) {
           return (one.effective | one.permitted | one.inheritable) == 0;
         });
}

// Sets the restrictions that all helpers share. `readable` and `program` are as in enter_sandbox().
void shut_in(std::uint64_t memory_bytes, const std::vector<std::filesystem::path>& readable,
             const std::filesystem::path& program) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  // Sanitizers reserve more memory than any limit allows, and have no sandbox.
  const rlimit memory{memory_bytes, memory_bytes};
  ::setrlimit(RLIMIT_DATA, &memory);
#else
  (void)memory_bytes;
#endif
  const Sandboxed in = enter_sandbox(readable, program);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  if (!in.calls || !in.files)
    std::fprintf(stderr, "this kernel has no %s: strangers' files are read without it\n",
                 in.calls ? "Landlock" : "seccomp");
#else
  (void)in;
#endif
}

}  // namespace

Sandboxed enter_sandbox(const std::vector<std::filesystem::path>& readable,
                        const std::filesystem::path& program) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  (void)readable;
  (void)program;
  (void)drop_capabilities;
  (void)bound_files;
  return {};
#else
  const bool files = bound_files(readable, program);
  const bool rights = drop_capabilities();
  return {limit_calls() && rights, files};
#endif
}

void shut_in_helper(std::uint64_t memory_bytes) {
  shut_in(memory_bytes, {}, {});
  forbid_processes();
}

int become_shut_in(ShutInProgram program) {
  std::vector<char*> argv;
  for (std::string& each : program.arguments) argv.push_back(each.data());
  argv.push_back(nullptr);
  const rlimit files{program.file_bytes, program.file_bytes};
  ::setrlimit(RLIMIT_FSIZE, &files);
  std::error_code error;
  shut_in(program.memory_bytes, program.readable, std::filesystem::canonical(argv.front(), error));
  forbid_children();
  ::alarm(program.seconds);  // stays set in the new program
  ::execv(argv.front(), argv.data());
  return errno;
}

}  // namespace ls
