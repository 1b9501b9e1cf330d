#include "precompute/base/child_process.h"

#include <fmt/core.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <new>

#include "precompute/base/defects.h"
#include "precompute/base/packing.h"

namespace archetide {

template <class Archive>
void fields(Archive& archive, Diagnostic& d) {
  archive(d.where.file, d.where.line, d.where.column, d.what, d.hint);
}

namespace {

/// What an answer holds.
enum class Kind : char { kResult, kDefects, kInput, kFile, kMachine, kOther };

template <class... T>
std::string packed(Kind kind, const T&... values) {
  Packer pack;
  pack(kind, values...);
  return std::move(pack.bytes);
}

std::string answer_of(const std::function<std::string()>& work) {
  try {
    return packed(Kind::kResult, work());
  } catch (const SurfaceDefects& error) {
    return packed(Kind::kDefects, error.diagnostics, error.offenders);
  } catch (const InputError& error) {
    return packed(Kind::kInput, error.diagnostics);
  } catch (const FileError& error) {
    return packed(Kind::kFile, std::string(error.what()));
  } catch (const MachineError& error) {
    return packed(Kind::kMachine, std::string(error.what()));
  } catch (const std::bad_alloc&) {
    return packed(Kind::kMachine, std::string("out of memory"));
  } catch (const std::exception& error) {
    return packed(Kind::kOther, std::string(error.what()));
  }
}

/// The result, or what was thrown.
std::string result_of(std::string answer) {
  Unpacker unpack(std::move(answer));
  Kind kind{};
  std::string text;
  std::vector<Diagnostic> list;
  TriMesh offenders;
  unpack(kind);
  if (kind == Kind::kDefects)
    unpack(list, offenders);
  else if (kind == Kind::kInput)
    unpack(list);
  else
    unpack(text);
  switch (kind) {
    case Kind::kResult:
      return text;
    case Kind::kDefects:
      throw SurfaceDefects(list, offenders);
    case Kind::kInput:
      throw InputError(list);
    case Kind::kFile:
      throw FileError(text);
    case Kind::kMachine:
      throw MachineError(text);
    case Kind::kOther:
      break;
  }
  throw NumericsError(text);
}

rlim_t whole_seconds(double cpu_seconds) {
  return static_cast<rlim_t>(std::max(1.0, std::ceil(cpu_seconds)));
}

double seconds(const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); }

[[noreturn]] void work_in_child(pid_t parent, int pipe_end, double cpu_seconds,
                                const std::function<std::string()>& work) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);     // not longer than the parent
  if (::getppid() != parent) ::_exit(0);  // which ended before that
  const rlimit time{whole_seconds(cpu_seconds), whole_seconds(cpu_seconds) + 1};
  ::setrlimit(RLIMIT_CPU, &time);
  ::signal(SIGXCPU, SIG_DFL);
  ::signal(SIGINT, SIG_DFL);  // the parent cleans up
  ::signal(SIGTERM, SIG_DFL);
  ::signal(SIGHUP, SIG_DFL);
  const rlimit no_core{};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const std::string answer = answer_of(work);
  for (std::size_t at = 0; at < answer.size();) {
    const ssize_t n = ::write(pipe_end, answer.data() + at, answer.size() - at);
    if (n < 0 && errno != EINTR) break;
    if (n > 0) at += static_cast<std::size_t>(n);
  }
  ::_exit(0);
}

/// The child and our end of its pipe; neither outlives this.
class Child {
 public:
  Child(const std::string& name, double cpu_seconds, const std::function<std::string()>& work) {
    int ends[2];
    if (::pipe(ends) != 0) throw MachineError(name + ": no pipe: " + std::strerror(errno));
    const pid_t parent = ::getpid();
    pid_ = ::fork();
    if (pid_ == 0) {
      ::close(ends[0]);
      work_in_child(parent, ends[1], cpu_seconds, work);
    }
    ::close(ends[1]);
    pipe_end_ = ends[0];
    if (pid_ < 0) {
      ::close(pipe_end_);
      throw MachineError(name + ": no process: " + std::strerror(errno));
    }
  }
  ~Child() {
    ::close(pipe_end_);
    if (pid_ < 0) return;
    ::kill(pid_, SIGKILL);
    rusage use{};
    wait(use);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  std::string read_all() {
    std::string bytes;
    std::array<char, 1 << 16> buffer;
    for (ssize_t n; (n = ::read(pipe_end_, buffer.data(), buffer.size())) != 0;) {
      if (n > 0) bytes.append(buffer.data(), static_cast<std::size_t>(n));
      if (n < 0 && errno != EINTR) break;
    }
    return bytes;
  }

  /// How it ended, and what it used.
  int wait(rusage& use) {
    int status = 0;
    while (::wait4(pid_, &status, 0, &use) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

 private:
  pid_t pid_ = -1;
  int pipe_end_ = -1;
};

}  // namespace

std::string in_child_process(const std::string& name, double& cpu_seconds,
                             const std::function<std::string()>& work) {
  Child child(name, cpu_seconds, work);
  std::string answer = child.read_all();
  rusage use{};
  const int status = child.wait(use);
  const bool stopped = WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU;
  const rlim_t allowed = whole_seconds(cpu_seconds);
  cpu_seconds -= seconds(use.ru_utime) + seconds(use.ru_stime);
  if (stopped) throw OutOfTime(fmt::format("{} was stopped after {} CPU seconds", name, allowed));
  if (WIFSIGNALED(status) || answer.empty())
    throw NumericsError(
        name + " crashed" +
        (WIFSIGNALED(status) ? fmt::format(" (signal {})", WTERMSIG(status)) : std::string()));
  return result_of(std::move(answer));
}

}  // namespace archetide
