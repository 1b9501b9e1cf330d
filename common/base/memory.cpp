#include "common/base/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <limits>
#include <sstream>

#include "common/base/input_error.h"

namespace archetide {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();

double free_on_machine() {
  std::ifstream in("/proc/meminfo");
  for (std::string name; in >> name;) {
    double kib = 0.0;
    if (name == "MemAvailable:" && in >> kib) return 1024 * kib;
    in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return kUnknown;
}

/// The number in a file, infinity when there is none ("max").
double number_in(const std::string& path) {
  std::ifstream in(path);
  double value = 0.0;
  return in >> value ? value : kUnknown;
}

/// What a control group may still take: its limit less what it uses, of which the system gives up
/// the cached files. Infinity where there is no limit.
double free_in_folder(const std::string& folder, const std::string& limit, const std::string& used,
                      const std::string& prefix) {
  const double most = number_in(folder + limit), now = number_in(folder + used);
  if (!std::isfinite(most) || !std::isfinite(now)) return kUnknown;
  double cached = 0.0, bytes = 0.0;
  std::ifstream in(folder + "memory.stat");
  for (std::string name; in >> name >> bytes;)
    if (name == prefix + "inactive_file" || name == prefix + "active_file") cached += bytes;
  return most - now + std::min(cached, now);
}

/// Bytes of address space and of memory that this process uses.
void usage(double& address_space, double& resident) {
  std::ifstream in("/proc/self/statm");
  const auto page = static_cast<double>(::sysconf(_SC_PAGESIZE));
  double pages = 0.0;
  address_space = in >> pages ? page * pages : 0.0;
  resident = in >> pages ? page * pages : 0.0;
}

double address_space_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kUnknown;
  return static_cast<double>(limit.rlim_cur);
}

double limit_of_environment() {
  const char* text = std::getenv("ARCHETIDE_MEMORY_LIMIT");
  if (!text || !*text) return kUnknown;
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  const std::string unit = end;
  const double factor = unit.empty()  ? 1.0
                        : unit == "K" ? 1024.0
                        : unit == "M" ? 1048576.0
                                      : 1073741824.0;
  if (end == text || !(value > 0) || (!unit.empty() && unit != "K" && unit != "M" && unit != "G"))
    throw InputError(std::string("ARCHETIDE_MEMORY_LIMIT=") + text + ": not a number of bytes",
                     "write for example 800M or 4G");
  return factor * value;
}

std::string megabytes(double bytes) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(0) << bytes / 1e6 << " MB";
  return text.str();
}

}  // namespace

double free_in_control_groups(const std::string& groups_file, const std::string& root) {
  double least = kUnknown;
  std::ifstream in(groups_file);
  for (std::string line; std::getline(in, line);) {  // number:controllers:/path
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    if (!controllers.empty() && controllers != "memory") continue;
    // The group and those around it, as far as they are seen from here.
    for (std::string path = line.substr(second + 1);; path.resize(path.rfind('/'))) {
      if (path == "/") path.clear();
      const double here =
          controllers.empty()
              ? free_in_folder(root + path + "/", "memory.max", "memory.current", "")
              : free_in_folder(root + "/memory" + path + "/", "memory.limit_in_bytes",
                               "memory.usage_in_bytes", "total_");
      least = std::min(least, here);
      if (path.find('/') == std::string::npos) break;
    }
  }
  return least;
}

double available_memory() {
  double address_space = 0.0, resident = 0.0;
  usage(address_space, resident);
  double least = std::min(free_on_machine(), address_space_limit() - address_space);
  least = std::min(least, limit_of_environment() - resident);
  least = std::min(least, free_in_control_groups("/proc/self/cgroup", "/sys/fs/cgroup"));
  return std::max(0.0, least);
}

double peak_memory() {
  double peak = 0.0;
  for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage use{};
    ::getrusage(who, &use);
    peak = std::max(peak, 1024.0 * static_cast<double>(use.ru_maxrss));
  }
  return peak;
}

void demand_memory(double bytes, const std::string& what, const std::string& hint) {
  const double available = available_memory();
  if (bytes <= available) return;
  throw MachineError(what + " needs " + megabytes(bytes) + " of memory, " + megabytes(available) +
                     " are available\n  " + hint);
}

}  // namespace archetide
