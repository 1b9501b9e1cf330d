#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/base/number_text.h"
#include "common/files/html_text.h"
#include "runtime/output/report_parts.h"

namespace archetide {
namespace {

std::string number_cell(const TextTable& t, std::size_t n, const char* column, const char* format) {
  const double value = t.number(n, column);
  if (std::isnan(value)) return "";
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// Share of the target as a bar; one tenth of it is a third of the way, ten times it fills it.
std::string share_bar(double error, double target) {
  const double share = std::abs(error) / target;
  const double length =
      std::clamp((std::log10(std::max(share, 1e-9)) + 2.0) / 3.0, 0.02, 1.0) * 90.0;
  char text[32];
  std::snprintf(text, sizeof text, share < 0.01 ? "%.0e %%" : "%.0f %%", 100.0 * share);
  return "<i class=\"bar" + std::string(share > 1.0 ? " over" : "") +
         "\" style=\"width:" + fixed_text(length, 0) + "px\"></i> " + text;
}

std::vector<std::string> cells_of(const TextTable& t, std::size_t n) {
  const std::string iterations = t.at(n, "iterations");
  return {html_text(t.at(n, "quantity")),
          html_text(t.at(n, "resolution")),
          number_cell(t, n, "value", "%.6g"),
          number_cell(t, n, "reference", "%.6g"),
          number_cell(t, n, "error", "%+.2e"),
          number_cell(t, n, "target", "%.1e"),
          share_bar(t.number(n, "error"), t.number(n, "target")),
          number_cell(t, n, "order", "%.1f"),
          number_cell(t, n, "cpu_seconds", "%.2f"),
          iterations == "0" ? "" : iterations};
}

std::string wide_row(const std::string& html) {
  return "<tr class=\"about\"><td colspan=\"10\">" + html + "</td></tr>\n";
}

// The rows, a line about each case above them; with `why`, the reason of a miss below them.
std::string rows_of(const TextTable& t, const std::vector<std::size_t>& rows, bool why) {
  std::string html = "<table class=\"score\">" +
                     html_row({"quantity", "resolution", "value", "reference", "error", "target",
                               "share of target", "order", "CPU s", "iterations"},
                              "th");
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const std::size_t n = rows[k];
    const std::string& name = t.at(n, "case");
    if (k == 0 || name != t.at(rows[k - 1], "case"))
      html += wide_row("<b>" + html_text(name) + "</b>: " + html_text(t.at(n, "about")));
    html += html_row(cells_of(t, n), "td", t.at(n, "pass") == "1" ? "" : "miss");
    const std::string& reason = t.at(n, "reason");
    const bool last = k + 1 == rows.size() || t.at(rows[k + 1], "case") != name ||
                      t.at(rows[k + 1], "reason") != reason;
    if (why && last)
      html += wide_row(reason.empty() ? "<b>Not known: look at it.</b>"
                                      : "Known: " + html_text(reason));
  }
  return html + "</table>\n";
}

}  // namespace

bool is_scorecard(const TextTable& t) {
  return t.has("quantity") && t.has("target") && t.has("pass");
}

std::string scorecard_section(const TextTable& t) {
  std::vector<std::size_t> all, missed;
  std::size_t unknown = 0;
  // Rows of one case may share their seconds: the most expensive of each stands for it.
  std::map<std::string, double> seconds;
  for (std::size_t n = 0; n < t.rows.size(); ++n) {
    all.push_back(n);
    if (t.at(n, "pass") != "1") missed.push_back(n), unknown += t.at(n, "reason").empty();
    seconds[t.at(n, "case")] = std::max(seconds[t.at(n, "case")], t.number(n, "cpu_seconds"));
  }
  double cpu = 0.0;
  for (const auto& [name, s] : seconds) cpu += s;
  std::string html = fmt::format(
      "<h2>Scorecard</h2>\n"
      "<p class=\"note\"><b>{} of {} figures meet their target</b>, in {} cases with known "
      "answers; {} misses are known and explained, {} are not. The most expensive rows of all "
      "cases took {} CPU seconds together. Bars: error as a share of its target, on a scale of "
      "powers of ten from 1 % to 1000 %.</p>\n",
      all.size() - missed.size(), all.size(), seconds.size(), missed.size() - unknown, unknown,
      fixed_text(cpu, 0));
  if (!missed.empty()) html += "<h3>Misses</h3>\n" + rows_of(t, missed, true);
  return fmt::format("{}<details><summary>All {} rows</summary>\n{}</details>\n", html, all.size(),
                     rows_of(t, all, false));
}

std::string html_row(const std::vector<std::string>& cells, const char* tag,
                     const std::string& row_class) {
  std::string html = row_class.empty() ? "<tr>" : "<tr class=\"" + row_class + "\">";
  for (const std::string& cell : cells)
    html += "<" + std::string(tag) + ">" + cell + "</" + tag + ">";
  return html + "</tr>\n";
}

}  // namespace archetide
