#include "precompute/child_process.h"

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

#include "common/byte_stream.h"
#include "common/input_error.h"

namespace archetide {
namespace {

constexpr char kMesh = 'm', kError = 'e';  // first byte of an answer

std::string packed(const TetMesh& mesh) {
  std::string bytes(1, kMesh);
  append_number(bytes, mesh.nodes.size());
  append_number(bytes, mesh.tets.size());
  for (const Vec3& x : mesh.nodes)
    for (const double coordinate : x) append_number(bytes, coordinate);
  for (const auto& tet : mesh.tets)
    for (const int node : tet) append_number(bytes, node);
  return bytes;
}

TetMesh unpacked(const std::string& bytes) {
  std::size_t at = 1;
  TetMesh mesh;
  mesh.nodes.resize(take_number<std::size_t>(bytes, at));
  mesh.tets.resize(take_number<std::size_t>(bytes, at));
  for (Vec3& x : mesh.nodes)
    for (double& coordinate : x) coordinate = take_number<double>(bytes, at);
  for (auto& tet : mesh.tets)
    for (int& node : tet) node = take_number<int>(bytes, at);
  return mesh;
}

std::string answer_of(const std::function<TetMesh()>& work) {
  try {
    return packed(work());
  } catch (const std::exception& error) {
    return kError + std::string(error.what());
  }
}

rlim_t whole_seconds(double cpu_seconds) {
  return static_cast<rlim_t>(std::max(1.0, std::ceil(cpu_seconds)));
}

double seconds(const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); }

[[noreturn]] void work_in_child(int pipe_end, double cpu_seconds,
                                const std::function<TetMesh()>& work) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // not longer than the parent
  const rlimit time{whole_seconds(cpu_seconds), whole_seconds(cpu_seconds) + 1};
  ::setrlimit(RLIMIT_CPU, &time);
  ::signal(SIGXCPU, SIG_DFL);
  ::signal(SIGINT, SIG_DFL);  // the parent cleans up
  ::signal(SIGTERM, SIG_DFL);
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

std::string read_all(int pipe_end) {
  std::string bytes;
  std::array<char, 1 << 16> buffer;
  for (ssize_t n; (n = ::read(pipe_end, buffer.data(), buffer.size())) != 0;) {
    if (n > 0) bytes.append(buffer.data(), static_cast<std::size_t>(n));
    if (n < 0 && errno != EINTR) break;
  }
  return bytes;
}

}  // namespace

TetMesh in_child_process(const std::string& name, double& cpu_seconds,
                         const std::function<TetMesh()>& work) {
  int ends[2];
  if (::pipe(ends) != 0) throw MachineError(name + ": no pipe: " + std::strerror(errno));
  const pid_t child = ::fork();
  if (child < 0) throw MachineError(name + ": no process: " + std::strerror(errno));
  if (child == 0) {
    ::close(ends[0]);
    work_in_child(ends[1], cpu_seconds, work);
  }
  ::close(ends[1]);
  const std::string answer = read_all(ends[0]);
  ::close(ends[0]);
  int status = 0;
  rusage use{};
  while (::wait4(child, &status, 0, &use) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
    throw OutOfTime(name + " was stopped after " + std::to_string(whole_seconds(cpu_seconds)) +
                    " CPU seconds");
  cpu_seconds -= seconds(use.ru_utime) + seconds(use.ru_stime);
  if (WIFSIGNALED(status) || answer.empty())
    throw NumericsError(name + " crashed" +
                        (WIFSIGNALED(status) ? " (signal " + std::to_string(WTERMSIG(status)) + ")"
                                             : std::string()));
  if (answer[0] == kError) throw NumericsError(answer.substr(1));
  return unpacked(answer);
}

}  // namespace archetide
