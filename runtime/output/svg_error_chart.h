#pragma once

#include <string>
#include <vector>

namespace archetide {

/// Points of error against cost that belong together, joined in their order.
struct ErrorSeries {
  std::string name, colour;
  std::vector<double> cost, error;  // those that are not positive are left out
  std::vector<std::string> labels;  // beside each point
  std::vector<bool> on_front;       // drawn full, others hollow
};

/// Error against cost, both in powers of ten, and the front of what no other point beats in both.
std::string svg_error_chart(const std::string& title, const std::string& x_label,
                            const std::string& y_label, const std::vector<ErrorSeries>& series);

}  // namespace archetide
