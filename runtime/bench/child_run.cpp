#include "runtime/bench/child_run.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>

#include "common/base/input_error.h"

namespace archetide {
namespace {

double seconds(const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); }

[[noreturn]] void become(std::vector<char*> arguments, const char* log) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::signal(SIGINT, SIG_IGN);  // the parent passes it on as SIGTERM
  const int file = ::open(log, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (file >= 0) ::dup2(file, STDOUT_FILENO), ::dup2(file, STDERR_FILENO);
  ::execv(arguments[0], arguments.data());
  ::_exit(kExitMachine);
}

}  // namespace

ChildEnd run_child(const std::vector<std::string>& arguments, const std::string& log,
                   const volatile std::sig_atomic_t& stop) {
  std::vector<std::string> words = arguments;
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const auto start = std::chrono::steady_clock::now();
  const pid_t child = ::fork();
  if (child < 0) throw MachineError(std::string("no process: ") + std::strerror(errno));
  if (child == 0) become(pointers, log.c_str());
  int status = 0;
  rusage use{};
  bool told = false;
  for (pid_t ended = 0; ended != child;) {
    ended = ::wait4(child, &status, WNOHANG, &use);
    if (ended < 0 && errno != EINTR)
      throw MachineError(std::string("wait: ") + std::strerror(errno));
    if (stop && !told) ::kill(child, SIGTERM), told = true;
    if (ended == 0) ::usleep(20'000);
  }
  ChildEnd end;
  end.exit = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  end.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  end.cpu_seconds = seconds(use.ru_utime) + seconds(use.ru_stime);
  end.wall_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  end.peak_bytes = 1024.0 * double(use.ru_maxrss);
  return end;
}

}  // namespace archetide
