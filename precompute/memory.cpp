#include "precompute/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <limits>
#include <sstream>

#include "common/input_error.h"

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

double free_in_group() {
  const std::string folder = "/sys/fs/cgroup/";
  return std::min(number_in(folder + "memory.max") - number_in(folder + "memory.current"),
                  number_in(folder + "memory/memory.limit_in_bytes") -
                      number_in(folder + "memory/memory.usage_in_bytes"));
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

double available_memory() {
  double address_space = 0.0, resident = 0.0;
  usage(address_space, resident);
  double least = std::min(free_on_machine(), address_space_limit() - address_space);
  least = std::min(least, limit_of_environment() - resident);
  const double group = free_in_group();  // NaN where there is no group with a limit
  return std::max(0.0, group < least ? group : least);
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

double least_memory(double tets, int order, int modes) {
  const double nodes = order == 1 ? tets / 5.2 : 1.4 * tets;  // of compact meshes
  const double dofs = 3 * nodes;
  const double neighbours = order == 1 ? 14 : 28;               // of a node, and itself
  const double matrices = 2 * dofs * 3 * neighbours * (8 + 4);  // K and M: value and row
  const double vectors = 8 * dofs * (3.0 * modes + 20);         // ARPACK's basis, the modes
  // Nested dissection of a plate, nnz(L) >= 31/4 n log2 n with n nodes of 3 x 3 blocks, one layer.
  const double factor = 8 * 9 * 7.75 * nodes * std::log2(std::max(2.0, nodes)) / 2;
  return 1000 * tets + matrices + vectors + factor;
}

}  // namespace archetide
