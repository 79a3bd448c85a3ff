// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/laplace_section.h"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/analysis/laplace_start.h"
#include "core/discretization/grid.h"
#include "core/format_number.h"
#include "core/laplace/contour_choice.h"
#include "core/laplace/iteration_bounds.h"
#include "core/laplace/kernel.h"
#include "core/laplace/resolvent.h"

namespace dlcs {
namespace {

// Times at which what depends on the contour's position is measured: T and its halves.
std::vector<double> Halvings(double horizon, int count) {
  std::vector<double> times;
  for (int k = 0; k < count; ++k) times.push_back(std::ldexp(horizon, -k));
  return times;
}

class LaplaceWriter {
 public:
  LaplaceWriter(const Problem& problem, const Options& options, const MatrixClass& matrix_class, Selection selection)
      : problem_(problem), options_(options), matrix_class_(matrix_class), selection_(selection) {
    section_.id = "laplace-inversion";
    section_.title = "Iteration by Laplace inversion";
  }

  AnalysisSection Write() && {
    const bool lipschitz = WriteLipschitz();
    if (!lipschitz || problem_.num_states() > kMaxLaplaceStates) return std::move(section_);
    const Resolvent resolvent(problem_.A);
    WriteSector(resolvent);
    if (sectorial_) WriteContour(resolvent);
    if (matrix_class_.lipschitz) WriteWindow();
    return std::move(section_);
  }

 private:
  void AddConstant(std::string id, std::string symbol, std::string title, std::optional<double> value,
                   ConstantKind kind, std::string why, std::string source) {
    section_.constants.push_back(
        {std::move(id), std::move(symbol), std::move(title), value, kind, std::move(why), std::move(source)});
  }

  bool WriteLipschitz() {
    Finding finding{
        "lipschitz", "y is a Lipschitz function of the state", {}, "Lemma 2.1 and Lemma 3.1 of [Wu & Chen]"};
    const bool unique = selection_ == Selection::kUnique, least = selection_ == Selection::kLeastElement;
    finding.fact.answer = unique || least ? Answer::kYes : Answer::kNo;
    finding.fact.why = unique  ? "M is a P-matrix, so this holds for every q"
                       : least ? "the least element for a Z-matrix, where FEA(q, M) is not empty"
                               : "no rule selects a solution of LCP(q, M), so y is not a function of the state";
    if (selection_ == Selection::kHiddenLeastElement) {
      finding.fact = {Answer::kYes, "the least element of the cone pos X for a hidden Z-matrix"};
    } else if (!unique && !least && selection_ != Selection::kAny) {
      finding.fact = {Answer::kUnknown, absl::StrCat(SelectionName(selection_), " may jump where the state moves")};
    }
    section_.findings.push_back(finding);
    return unique || least;
  }

  void WriteSector(const Resolvent& resolvent) {
    const double alpha = SectorAngle(resolvent.Eigenvalues());
    contour_ = ContourFor(options_, alpha);
    const double allowed = std::numbers::pi / 2 - contour_.gamma;
    sectorial_ = alpha < allowed;
    AddConstant("alpha", "α", "half angle of the sector around the spectrum of A", alpha, ConstantKind::kExact,
                "largest |arg(-λ)|", "(2.1a) of [Wu & Chen]");
    Finding finding{"sector", "The spectrum of A lies inside the contour", {}, "Theorem 2.2 of [Wu & Chen]"};
    finding.fact.answer = sectorial_ ? Answer::kYes : Answer::kNo;
    finding.fact.why =
        "α = " + FormatNumber(alpha) + (sectorial_ ? " is" : " is not") +
        " smaller than π/2 - γ = " + FormatNumber(allowed) +
        (sectorial_ ? ""
                    : "; laplace-iteration does not depend on it, and wu-chen-iteration splits off what lies outside");
    section_.findings.push_back(finding);
  }

  void WriteContour(const Resolvent& resolvent) {
    AddConstant("theta-1", "Θ_1", "weight of the first iteration", Theta(contour_, 1), ConstantKind::kExact, "",
                "(2.7b) of [Wu & Chen]");
    AddConstant("theta-max", "Θ_max", "bound of all Θ_l", ThetaMax(contour_), ConstantKind::kUpperBound, "",
                "(2.15) of [Wu & Chen]");
    const double phi = ResolventFactor(contour_, resolvent, Halvings(problem_.horizon, 16));
    AddConstant("phi", "φ", "largest |z| ‖(zI - A)⁻¹‖ on the contour", phi, ConstantKind::kEstimate,
                "measured at the contours of 16 times from T downwards", "(2.1b) of [Wu & Chen]");
    const auto quadrature = WriteQuadrature(resolvent);
    if (!matrix_class_.lipschitz) return;
    const double rate = IterationRate(contour_, phi, *matrix_class_.lipschitz, problem_);
    AddConstant("l-tilde", "L̃", "rate of the iteration", rate, ConstantKind::kUpperBound, "φ as measured",
                "(2.13) of [Wu & Chen]");
    WriteIterations(rate, quadrature);
    if (selection_ == Selection::kLeastElement) WriteStart(rate);
  }

  std::optional<double> WriteQuadrature(const Resolvent& resolvent) {
    std::optional<double> error;
    std::string why = "more than " + std::to_string(kMaxQuadratureStates) + " states";
    if (problem_.num_states() <= kMaxQuadratureStates) {
      error = SourceQuadratureError(contour_, resolvent, problem_.A, Halvings(problem_.horizon, 4));
      why = "of a source B y + f of size 1, measured at four times from T downwards";
    }
    AddConstant("quadrature-error", "Err_max", "error of the contour quadrature in x", error, ConstantKind::kEstimate,
                why, "(2.8), (2.12) of [Wu & Chen]");
    return error;
  }

  void WriteIterations(double rate, std::optional<double> quadrature) {
    IterationBound bound(contour_, rate, problem_.horizon);
    AddConstant(
        "iterations", "k", "iterations of wu-chen-iteration that are enough",
        bound.IterationsFor(options_.iteration_tolerance), ConstantKind::kUpperBound,
        "over [0, T] as one window, for an error of " + FormatNumber(options_.iteration_tolerance) + " of the first",
        "(2.7a) of [Wu & Chen]");
    const double amplification = bound.LogAmplification() / std::log(10.0);
    AddConstant("log10-amplification", "log₁₀ Σ F_r", "what an error of each iteration can grow by, as a power of ten",
                amplification, ConstantKind::kUpperBound, "", "(2.14a) of [Wu & Chen]");
    if (!quadrature) return;
    AddConstant("log10-accuracy", "log₁₀ |x*_P - x|",
                "accuracy of the converged x, as a power of ten, without the O(h) of (2.18)",
                std::log10(*quadrature) + amplification, ConstantKind::kEstimate, "for sources B y + f of size 1",
                "(2.8), (2.18) of [Wu & Chen]");
  }

  void WriteStart(double rate) {
    const GuaranteedStart start = MeasureGuaranteedStart(problem_, selection_, rate * ThetaMax(contour_));
    const std::string why = start.failure.empty() ? "measured at 257 nodes" : start.failure;
    AddConstant("feasible-radius", "ρ", "how far q may move and LCP(q, M) stays feasible", start.radius,
                ConstantKind::kLowerBound, start.failure.empty() ? "by a linear program" : why, "(3.4) of [Wu & Chen]");
    if (!start.failure.empty()) return;
    AddConstant("beta", "β", "how far x may move on [0, T*]", start.beta, ConstantKind::kEstimate, why,
                "(3.5) of [Wu & Chen]");
    AddConstant("c-0", "C_0", "how far the first iterate moves on [0, T*]", start.first_move, ConstantKind::kEstimate,
                "sup ‖x^1 - x0‖ itself; the printed ‖e^{At}‖‖x0‖ is at least ‖x0‖ for every T*",
                "(3.6) of [Wu & Chen]");
    AddConstant("t-star", "T*", "interval on which all iterates are feasible", start.t_star, ConstantKind::kEstimate,
                why, "Theorem 3.2 of [Wu & Chen]");
    AddConstant("t-star-from-x0", "T*₀", "the same, without the last term of (3.6)", start.t_star_from_x0,
                ConstantKind::kEstimate, "the start x^0 = x0 makes that term zero",
                "proof of Theorem 3.2 of [Wu & Chen]");
    if (start.t_star_from_x0 < problem_.horizon) {
      section_.warnings.push_back("The iteration from a constant start is guaranteed to stay feasible on [0, " +
                                  FormatNumber(start.t_star_from_x0) +
                                  "] only; laplace-iteration shortens its windows where it does not.");
    }
  }

  void WriteWindow() {
    const Grid grid = MakeGrid(problem_.horizon, BreakPoints(problem_), options_);
    const Scheme scheme = ExponentialPiecewiseLinear(problem_, grid.longest_step);
    Workers workers(1);
    KernelRecord record;
    Kernel kernel(problem_, scheme, KernelSource::kPhiFunctions, workers, record);
    kernel.Reserve(2, {});
    const double rate = *matrix_class_.lipschitz * kernel.Bound(2) * scheme.step;
    const double window = RecommendedWindow(rate, static_cast<double>(grid.num_steps()));
    AddConstant("kappa-kernel", "κ", "how fast y moves N x", kernel.Bound(2), ConstantKind::kExact,
                "largest of the first two blocks of the kernel over h = " + FormatNumber(scheme.step), "");
    AddConstant("window", "W", "steps of a window where the iteration contracts from the start", window,
                ConstantKind::kEstimate, "L κ h W <= 1", "");
    const auto count = ReducedIterationsFor(rate, window, options_.iteration_tolerance);
    AddConstant("window-iterations", "k_W", "iterations of laplace-iteration that are enough for such a window", count,
                ConstantKind::kEstimate,
                count ? "(L κ h)^k C(W + k - 1, k) as small as the tolerance"
                      : "L κ h = " + FormatNumber(rate) + " is not below 1: steps may have to be solved one by one",
                "");
  }

  const Problem& problem_;
  const Options& options_;
  const MatrixClass& matrix_class_;
  Selection selection_;
  Contour contour_;
  bool sectorial_ = false;
  AnalysisSection section_;
};

}  // namespace

AnalysisSection LaplaceSection(const Problem& problem, const Options& options, const MatrixClass& matrix_class,
                               Selection selection) {
  return LaplaceWriter(problem, options, matrix_class, selection).Write();
}

}  // namespace dlcs
