#include "tests/faults/process.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace archetide {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Polls until the child has ended or the time is up.
bool ends_within(pid_t child, double seconds, int& status, rusage& used) {
  const Clock::time_point start = Clock::now();
  while (::wait4(child, &status, WNOHANG, &used) != child) {
    if (since(start) > seconds) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

[[noreturn]] void become(const Command& command, const std::string& log) {
  const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (out < 0 || ::chdir(command.folder.c_str()) != 0) ::_exit(126);
  ::dup2(out, 1), ::dup2(out, 2), ::close(out);
  for (const std::string& entry : command.environment) ::putenv(const_cast<char*>(entry.c_str()));
  std::vector<char*> words;
  for (const std::string& word : command.words) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  command.before();
  ::execv(words[0], words.data());
  ::_exit(127);
}

}  // namespace

std::string wrong_code(const Ending& end, const std::string& wanted) {
  return fmt::format("exit {} instead of {}: {}", end.code, wanted, end.text);
}

pid_t start(const Command& command, const std::string& log) {
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process can be started");
  if (child == 0) become(command, log);
  return child;
}

Ending wait_for(pid_t child, double seconds, const std::string& log) {
  constexpr double kGrace = 20.0;  // s, to write a checkpoint
  const Clock::time_point begin = Clock::now();
  Ending end;
  int status = 0;
  rusage used{};
  if (!ends_within(child, seconds, status, used)) {
    end.timed_out = true;
    ::kill(child, SIGTERM);
    if (!ends_within(child, kGrace, status, used)) {
      end.deaf = true;
      ::kill(child, SIGKILL);
      ::wait4(child, &status, 0, &used);
    }
  }
  end.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  end.seconds = since(begin);
  end.peak_megabytes = static_cast<double>(used.ru_maxrss) / 1024.0;
  end.text = bytes_of(log).substr(0, 1 << 16);
  return end;
}

Ending run(const Command& command) {
  const std::string log =
      (std::filesystem::temp_directory_path() / fmt::format("archetide_log_{}", ::getpid()))
          .string();
  return wait_for(start(command, log), command.seconds, log);
}

bool kill_when(pid_t child, double delay, const std::function<bool()>& now) {
  const Clock::time_point start = Clock::now();
  siginfo_t info{};
  while (since(start) < delay && !now()) {
    info.si_pid = 0;
    if (::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
        info.si_pid == child)
      return false;
    std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
  ::kill(child, SIGKILL);
  return true;
}

std::string bytes_of(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

void write_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace archetide
