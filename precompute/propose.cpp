#include "precompute/propose.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>

#include "common/params/cli.h"
#include "common/params/param_tree.h"
#include "precompute/base/child_process.h"
#include "precompute/base/defects.h"
#include "precompute/base/joined.h"
#include "precompute/inspect/inspect.h"
#include "precompute/inspect/lines.h"
#include "precompute/intake/tet_io.h"
#include "precompute/modal/normal_motion.h"

namespace archetide {
namespace {

using lines::line;

constexpr int kLeastTets = 4'000, kMostTets = 16'000;
constexpr double kTrialYoung = 1e5;                  // Pa
constexpr double kPoisson = 0.4, kBeta = 0.005;      // 1, s
constexpr double kSag = 0.04;                        // of the longest side
constexpr double kSmallest = 0.01, kLargest = 10.0;  // m: sizes that need no warning
constexpr char kSlenderResidual[] = "1e-6";
constexpr double kGravity = 9.81, kWaterDensity = 1000.;  // m/s^2, kg/m^3

/// Three digits, as far as possible without an exponent.
std::string shown(double x) {
  std::ostringstream text;
  text.precision(3);
  text << x;
  return joined(std::stod(text.str()));
}

template <class Part>
const Part& shown(const Part& part) {
  return part;
}

template <class... Parts>
std::string phrase(const Parts&... parts) {
  return joined(shown(parts)...);
}

/// "2.4e4": two digits.
std::string two_digits(double x) {
  std::ostringstream text;
  text.precision(1);
  text << std::scientific << x;
  std::string digits = text.str();
  const std::size_t e = digits.find('e');
  const int exponent = std::stoi(digits.substr(e + 1));
  digits.resize(e);
  if (digits.ends_with(".0")) digits.resize(digits.size() - 2);
  return fmt::format("{}e{}", digits, exponent);
}

ParamNode number(double x) {
  ParamNode node;
  node.kind = ParamNode::Kind::kNumber;
  node.number = x;
  return node;
}

ParamNode string(const std::string& text) {
  ParamNode node;
  node.kind = ParamNode::Kind::kString;
  node.string = text;
  return node;
}

/// "key = value", as TOML writes it.
std::string setting(const std::string& key, const ParamNode& value) {
  ParamNode table;
  table.entries.push_back({key, value});
  std::string text = to_toml(table);
  text.pop_back();  // the end of the line
  return text;
}

/// A comment behind a value, all in one column.
std::string commented(std::string value, const std::string& comment) {
  constexpr std::size_t kColumn = 42;
  value.resize(std::max(kColumn, value.size() + 1), ' ');
  return value + "# " + comment + "\n";
}

// ---- what was found -----------------------------------------------------------------------------

/// A body file in the making. Comments are empty in a trial.
struct Draft {
  Repair repair = Repair::kNone;
  std::string defect;  // what the repair is for
  int target = kLeastTets;
  double young = kTrialYoung;
  int modes = ModesOptions().count;
  bool slender = false;  // round-off keeps the modes from their usual residual
  std::string above, scale = "mesh units to metres", tets, first_mode, damping,
                     patches;  // comments
};

std::string body_text(const ProposeRequest& request, const Draft& d) {
  std::string text = "# " + d.above + "Every key: archetide-precompute schema\nschema = 1\n" +
                     setting("mesh", string(request.mesh_name)) + "\n" +
                     commented(setting("scale", number(request.scale)), d.scale);
  if (d.repair != Repair::kNone)
    text += commented(std::string("repair = \"") + name_of(d.repair) + "\"", d.defect);
  if (!is_tet_file(request.mesh))
    text += commented(
        fmt::format("tet = {{ mesher = \"cgal\", target = {}_000 }}", d.target / 1000), d.tets);
  text += d.first_mode;
  text += "material = { " + setting("density", number(request.density)) +
          ", young = " + two_digits(d.young) + ", " + setting("poisson", number(kPoisson)) + " }\n";
  text += commented("damping = { alpha = 0.0, " + setting("beta", number(kBeta)) + " }", d.damping);
  if (!d.slender)
    return text + commented(fmt::format("modes = {{ count = {} }}", d.modes), d.patches);
  return text + commented(fmt::format("modes = {{ count = {}, residual = {} }}", d.modes,
                                      kSlenderResidual),
                          "slender: round-off keeps it above the usual 1e-8");
}

/// An archetype and what intake did for it.
struct Trial {
  Archetype body;
  std::vector<std::string> notes;
  std::vector<double> patch_error_of_modes;
};

Trial build_trial(const ProposeRequest& request, const Draft& draft, Profile& profile) {
  Recipe recipe = parse_recipe(body_text(request, draft), request.body);
  recipe.path = request.mesh;  // there is no body file to complain about
  recipe.mesh_where = {request.mesh};
  recipe.mesh_path = request.mesh;
  recipe.tet.cpu_seconds = request.cpu_seconds;
  const ScopedLogLevel quiet(LogLevel::kSilent);
  BuildRecord record;
  Trial trial;
  trial.body = build_archetype(recipe, profile, &record);
  trial.notes = record.notes;
  trial.patch_error_of_modes = record.patch_error_of_modes;
  return trial;
}

// ---- what builds --------------------------------------------------------------------------------

/// The gentlest repair that was not tried; false when there is none.
bool take_next_repair(const ProposeRequest& request, Draft& draft) {
  if (is_tet_file(request.mesh) || draft.repair == Repair::kWrap) return false;
  draft.repair = draft.repair == Repair::kNone   ? Repair::kFill
                 : draft.repair == Repair::kFill ? Repair::kUnion
                                                 : Repair::kWrap;
  return true;
}

/// More tets or, where these do not help, a wrap, which has no creases.
bool take_next_mesh(const ProposeRequest& request, Draft& draft) {
  if (is_tet_file(request.mesh)) return false;
  draft.slender = false;
  if (draft.target < kMostTets) {
    draft.target *= 2;
    return true;
  }
  if (draft.repair == Repair::kWrap) return false;
  draft.repair = Repair::kWrap;
  if (draft.defect.empty())
    draft.defect = phrase("as it is, up to ", kMostTets, " tets do not build");
  draft.target = kLeastTets;
  return true;
}

/// A residual in reach where round-off keeps the modes from the usual one, else another mesh.
bool take_next_numbers(const ProposeRequest& request, const NumericsError& error, Draft& draft) {
  if (dynamic_cast<const OutOfTime*>(&error)) return false;  // the next would take longer
  if (!dynamic_cast<const ResidualTooLarge*>(&error)) return take_next_mesh(request, draft);
  if (draft.slender) return false;
  return draft.slender = true;
}

/// The first complaint without its places, and without bytes that do not belong in a comment.
std::string in_short(const InputError& error) {
  std::string text = error.diagnostics.front().what;
  text.resize(std::min(text.find(": "), text.size()));
  if (error.diagnostics.size() > 1) text += ", and more";
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return text;
}

/// Builds the draft; false when it was changed for another attempt, because it does not build.
bool builds_or_changes(const ProposeRequest& request, Draft& draft, std::optional<Trial>& trial,
                       Profile& profile) {
  try {
    trial = build_trial(request, draft, profile);
    return true;
  } catch (const InputError& error) {
    const bool first = draft.repair == Repair::kNone;
    if (first && !dynamic_cast<const SurfaceDefects*>(&error)) throw;  // nothing to repair
    if (!take_next_repair(request, draft)) throw;
    if (first) {
      draft.defect = "as it is: " + in_short(error);
      log_warning(error.what());
    } else {
      log_detail(error.what());
    }
    log_info(std::string("trying repair = \"") + name_of(draft.repair) + "\"");
  } catch (const NumericsError& error) {
    if (!take_next_numbers(request, error, draft)) throw;
    log_warning(error.what());
    log_info(phrase("trying repair = \"", name_of(draft.repair), "\", ", draft.target, " tets",
                    draft.slender ? phrase(", modes.residual = ", kSlenderResidual) : ""));
  }
  return false;
}

/// The first attempt that builds; the draft is then what it was built from.
Trial first_that_builds(const ProposeRequest& request, Draft& draft, Profile& profile) {
  std::optional<Trial> trial;
  while (!builds_or_changes(request, draft, trial, profile)) {
  }
  for (const std::string& note : trial->notes) log_info(request.mesh + ": " + note);
  return std::move(*trial);
}

// ---- how many modes -----------------------------------------------------------------------------

constexpr double kPatchError = 0.15;  // that is small enough: the mean with the first modes
constexpr int kMostModes = 30;

double patch_error(const Trial& trial, int modes) {
  return trial.patch_error_of_modes[static_cast<std::size_t>(modes - 1)];
}

/// The usual number of modes; where these leave small deflections under loads on patches further
/// off than kPatchError and up to kMostModes do not, as few as that takes. Limbs need more, while
/// compact bodies are dented, which hardly any number of modes tells. The trial then has so many.
int enough_modes(const ProposeRequest& request, const Draft& draft, Trial& trial,
                 Profile& profile) {
  const int usual = trial.body.r();
  if (patch_error(trial, usual) <= kPatchError) return usual;
  Draft richer = draft;
  richer.modes = kMostModes;
  try {
    Trial more = build_trial(request, richer, profile);
    for (int k = usual; k < more.body.r(); ++k) {
      if (patch_error(more, k) > kPatchError) continue;
      trial = std::move(more);
      return cut_between_clusters(trial.body.omega2, k);
    }
  } catch (const InputError&) {
    // Too few nodes for so many.
  } catch (const NumericsError&) {
    // Round-off, or no time.
  }
  return usual;
}

// ---- figures ------------------------------------------------------------------------------------

/// What the water adds to the modal mass of the first mode, kg: rho l times the integral of the
/// square of its normal motion over the surface. l is that of the modes of degree 2 of a ball of
/// the same volume, a third of its radius.
double added_modal_mass(const Archetype& a) {
  const double length = std::cbrt(0.75 * a.volume / std::numbers::pi) / 3.0;
  return kWaterDensity * length * normal_motion_squared(a.surface, a.surface_modes.leftCols(1))[0];
}

/// What a proposal tells; SI units, frequencies in Hz.
struct Figures {
  Vec3 sides;
  double size, volume, mass, young, dry, wet, sag;
  double damping;  // ratio to critical of the first mode
  int modes;
  double patch_error;  // with these modes
};

Figures figures_of(const Trial& trial, int modes) {
  const Archetype& a = trial.body;
  Eigen::AlignedBox3d box;
  for (const Vec3& x : a.surface.vertices) box.extend(x);
  Figures f;
  f.sides = box.sizes();
  f.size = longest_side(a);
  f.volume = a.volume, f.mass = a.integrals.mass;
  f.young = proposed_young(kTrialYoung, a.omega2[0], f.size);
  const double omega2 = a.omega2[0] * f.young / kTrialYoung;
  f.dry = 0.5 / std::numbers::pi * std::sqrt(omega2);
  f.wet = f.dry / std::sqrt(1.0 + added_modal_mass(a) / a.M_r(0, 0));
  f.sag = kGravity / omega2 / f.size;
  f.damping = std::numbers::pi * f.dry * kBeta;
  f.modes = modes;
  f.patch_error = patch_error(trial, modes);
  return f;
}

std::string size_text(const Figures& f) {
  return phrase(f.sides[0], " x ", f.sides[1], " x ", f.sides[2], " m");
}

std::string mode_text(const Figures& f) {
  return phrase(f.dry, " Hz dry, about ", f.wet, " Hz in water");
}

std::string patches_text(const Figures& f) {
  return phrase("small deflections under loads on patches ", 100 * f.patch_error,
                " % off in the mean");
}

constexpr char kSofter[] =
    "young x 4 doubles the frequencies and quarters the sag; young / 4 does the opposite";

std::string summary_of(const ProposeRequest& request, const Draft& draft, const Archetype& a,
                       const Figures& f) {
  std::ostringstream text;
  line(text, "body", a.name + " from " + request.mesh);
  line(text, "size", size_text(f));
  line(text, "volume",
       phrase(f.volume, " m^3, mass ", f.mass, " kg at ") + joined(request.density, " kg/m^3"));
  if (draft.repair != Repair::kNone)
    line(text, "repair", std::string(name_of(draft.repair)) + "; " + draft.defect);
  line(text, "tets",
       fmt::format("{}, smallest dihedral {} degrees", a.tets.tets.size(), phrase(a.min_dihedral)));
  line(text, "young", two_digits(f.young) + " Pa");
  line(text, "first mode", mode_text(f));
  line(text, "sag", phrase(100 * f.sag, " % of its size under its own weight"));
  line(text, "modes", phrase(f.modes, ", ", patches_text(f)));
  line(text, "stiffer", kSofter);
  return text.str();
}

void add_comments(const ProposeRequest& request, const Archetype& a, const Figures& f,
                  Draft& draft) {
  draft.above = phrase(size_text(f), ", ", f.volume, " m^3, ", f.mass, " kg. ");
  draft.scale = "mesh units to metres; with twice the scale, twice young";
  draft.tets = fmt::format("{} tets, smallest dihedral {} degrees", a.tets.tets.size(),
                           phrase(a.min_dihedral));
  draft.first_mode = "# First mode " + mode_text(f) +
                     phrase("; sags by ", 100 * f.sag, " % of its size under its own weight.\n") +
                     "# " + kSofter + ".\n";
  draft.damping = phrase("first mode: ", 100 * f.damping, " % of critical");
  draft.patches = patches_text(f);
  draft.young = f.young;
  draft.modes = f.modes;
  if (request.density > kWaterDensity) draft.above += "Sinks. ";
}

}  // namespace

double proposed_young(double young, double omega2, double size) {
  return std::stod(two_digits(young * kGravity / (kSag * size) / omega2));
}

std::string size_warning(double size, double scale) {
  if (size >= kSmallest && size <= kLargest) return "";
  std::string hint;
  for (const auto& [unit, name] : {std::pair(1.0, "metres"), std::pair(0.01, "centimetres"),
                                   std::pair(0.001, "millimetres"), std::pair(0.0254, "inches")}) {
    const double then = size / scale * unit;
    if (unit != scale && then >= kSmallest && then <= kLargest)
      hint += phrase("\n  if the mesh is in ", name, " (", then, " m): scale = ", unit);
  }
  if (hint.empty()) hint = "\n  choose a scale that makes it 1 cm to 10 m";
  return phrase("the body is ", size, " m long", hint);
}

Proposal propose_body(const ProposeRequest& request, Profile& profile) {
  Draft draft;
  Trial trial = first_that_builds(request, draft, profile);
  const int modes = enough_modes(request, draft, trial, profile);
  const Archetype& a = trial.body;
  const Figures f = figures_of(trial, modes);
  Proposal proposal;
  proposal.summary = summary_of(request, draft, a, f);
  proposal.warning = size_warning(f.size, request.scale);
  add_comments(request, a, f, draft);
  proposal.text = body_text(request, draft);
  parse_recipe(proposal.text, request.body);
  return proposal;
}

}  // namespace archetide
