// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/circuit_problem.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <variant>

#include "core/circuits/circuit_branches.h"
#include "core/circuits/circuit_names.h"
#include "core/circuits/gate.h"
#include "core/circuits/linear_network.h"
#include "core/circuits/operating_point.h"
#include "core/format_number.h"
#include "core/problem/formula_syntax.h"

namespace dlcs {
namespace {

using RowVector = Eigen::RowVectorXd;

std::string FaultOfElement(const Element& element) {
  const auto must_be_positive = [&](const char* what, const char* unit) -> std::string {
    if (std::isfinite(element.value) && element.value > 0) return "";
    return std::string(what) + " of " + NumberText(element.value) + " " + unit + "; must be above 0";
  };
  switch (element.kind) {
    case ElementKind::kResistor:
      return must_be_positive("a resistance", "ohm");
    case ElementKind::kCapacitor:
      return must_be_positive("a capacitance", "F");
    case ElementKind::kInductor:
      return must_be_positive("an inductance", "H");
    case ElementKind::kVoltageSource:
    case ElementKind::kCurrentSource:
      return FaultOf(element.source);
    case ElementKind::kDiode: {
      const DiodeModel& diode = element.diode;
      if (!std::isfinite(diode.forward)) return "a forward voltage of " + NumberText(diode.forward) + " V";
      if (!(diode.on_resistance >= 0) || !std::isfinite(diode.on_resistance)) {
        return "an on-resistance of " + NumberText(diode.on_resistance) + " ohm; must be at least 0";
      }
      if (!(diode.off_resistance > 0)) {
        return "an off-resistance of " + NumberText(diode.off_resistance) + " ohm; must be above 0";
      }
      if (diode.breakdown && !(*diode.breakdown > 0)) {
        return "a breakdown voltage of " + NumberText(*diode.breakdown) + " V; must be above 0";
      }
      return "";
    }
    case ElementKind::kSwitch: {
      const SwitchModel& model = element.switching;
      if (!(model.on_resistance >= 0) || !std::isfinite(model.on_resistance)) {
        return "an on-resistance of " + NumberText(model.on_resistance) + " ohm; must be at least 0";
      }
      if (!(model.off_resistance > model.on_resistance)) {
        return "an off-resistance of " + NumberText(model.off_resistance) + " ohm; must be above the on-resistance";
      }
      if (!(model.hysteresis >= 0)) {
        return "a hysteresis of " + NumberText(model.hysteresis) +
               "; must be at least 0 (a smooth transition is not supported)";
      }
      return std::isfinite(model.threshold) ? "" : "the threshold is not finite";
    }
    default:
      return std::isfinite(element.value) ? "" : "the gain is not finite";
  }
}

// A name for states and pairs: letters, digits and _ alone, none that formulas reserve, and none twice.
class NameMaker {
 public:
  std::string Make(std::string name) {
    for (char& letter : name) {
      if (std::isalnum(static_cast<unsigned char>(letter)) == 0) letter = '_';
    }
    if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) != 0) name.insert(0, "_");
    static const std::set<std::string> kWords = {"t",  "pi", "e",  "and",  "or",    "not",
                                                 "in", "is", "if", "else", "lambda"};
    const bool is_function = std::any_of(kFormulaFunctions.begin(), kFormulaFunctions.end(),
                                         [&](const FormulaName& function) { return function.name == name; });
    const bool is_numbered = name.size() > 1 && (name[0] == 'x' || name[0] == 'y' || name[0] == 'w') &&
                             name.find_first_not_of("0123456789", 1) == std::string::npos;
    if (is_function || is_numbered || kWords.contains(name)) name += "_";
    while (!taken_.insert(name).second) name += "_";
    return name;
  }

 private:
  std::set<std::string> taken_;
};

// A linear function of x~, y, the sources and their derivatives.
struct LinearForm {
  RowVector x, y, s, ds;
};

class Formulation {
 public:
  explicit Formulation(const Circuit& circuit) : circuit_(circuit), graph_(MakeBranches(circuit)) {}

  absl::StatusOr<CircuitProblem> Make() {
    if (absl::Status status = CheckElements(); !status.ok()) return status;
    if (absl::Status status = SolveNetwork(); !status.ok()) return status;
    if (absl::Status status = SplitStorages(); !status.ok()) return status;
    if (absl::Status status = FindDynamics(); !status.ok()) return status;
    if (absl::Status status = FindGates(); !status.ok()) return status;
    if (absl::Status status = FindStart(); !status.ok()) return status;
    return Assemble();
  }

 private:
  const Element& ElementAt(Index index) const { return circuit_.elements[AsSize(index)]; }
  const LinearNetwork& network() const { return std::get<LinearNetwork>(network_); }
  Index num_states() const { return static_cast<Index>(states_.size()); }
  Index num_pairs() const { return static_cast<Index>(graph_.diodes.size()); }
  Index num_sources() const { return static_cast<Index>(graph_.sources.size()); }
  Index num_excess() const { return static_cast<Index>(excess_.size()); }

  absl::Status CheckElements() const {
    for (const Element& element : circuit_.elements) {
      if (const std::string fault = FaultOfElement(element); !fault.empty()) {
        return absl::InvalidArgumentError(WithPlace(element) + ": " + fault);
      }
      if (element.initial && !std::isfinite(*element.initial)) {
        return absl::InvalidArgumentError(WithPlace(element) + ": IC is not finite");
      }
    }
    for (const Coupling& coupling : circuit_.couplings) {
      if (std::abs(coupling.value) > 0 && std::abs(coupling.value) < 1) continue;
      return absl::InvalidArgumentError(
          coupling.name + ": a coupling of " + NumberText(coupling.value) +
          "; must be between 0 and 1 in size, without 0 and 1. A coupling of 1 makes the currents of the inductors "
          "dependent, which is not supported: 0.9999 leaves a leakage");
    }
    return absl::OkStatus();
  }

  absl::Status SolveNetwork() {
    network_ = LinearNetwork::Create(graph_.nodes, graph_.branches);
    if (const auto* fault = std::get_if<NetworkFault>(&network_)) {
      return StatusOfFault(*fault, graph_, circuit_, /*at_start=*/false);
    }
    return absl::OkStatus();
  }

  // States first, then the storages that depend on them.
  absl::Status SplitStorages() {
    for (Index k = 0; k < static_cast<Index>(graph_.storages.size()); ++k) {
      const StorageBranch& storage = graph_.storages[AsSize(k)];
      (network().InTree(storage.branch) == storage.is_capacitor ? states_ : excess_).push_back(k);
    }
    for (const Index k : excess_) {
      const Index branch = graph_.storages[AsSize(k)].branch;
      const RowVector row = Own(k);
      std::vector<Index> others;
      for (const DiodeBranch& diode : graph_.diodes) {
        if (row[network().InputOf(diode.branch)] != 0) others.push_back(diode.branch);
      }
      for (const Index other : excess_) {
        if (row[network().InputOf(graph_.storages[AsSize(other)].branch)] != 0) {
          others.push_back(graph_.storages[AsSize(other)].branch);
        }
      }
      if (others.empty()) continue;
      const std::vector<Index> around = network().InTree(branch) ? network().Cutset(branch) : network().Loop(branch);
      return absl::InvalidArgumentError(
          WithPlace(ElementAt(graph_.storages[AsSize(k)].element)) + " depends through controlled sources on " +
          ElementsOf(others, graph_, circuit_) + " (" + ElementsOf(around, graph_, circuit_) +
          (network().InTree(branch) ? " meet at a node" : " form a loop") +
          "), which is not supported. Put a small resistance in " + (network().InTree(branch) ? "parallel" : "series") +
          " with it");
    }
    return absl::OkStatus();
  }

  // The voltage of a capacitor, the current of an inductor; and its derivative times the value.
  RowVector Own(Index storage) const {
    const StorageBranch& given = graph_.storages[AsSize(storage)];
    return given.is_capacitor ? network().Voltage(given.branch) : network().Current(given.branch);
  }
  RowVector Drive(Index storage) const {
    const StorageBranch& given = graph_.storages[AsSize(storage)];
    return given.is_capacitor ? network().Current(given.branch) : network().Voltage(given.branch);
  }

  // Over states, pairs, sources and what drives the dependent storages.
  struct Parts {
    RowVector x, y, s, e;
  };
  Parts PartsOf(const RowVector& row) const {
    Parts parts{RowVector(num_states()), RowVector(num_pairs()), RowVector(num_sources()), RowVector(num_excess())};
    const auto at = [&](Index branch) { return row[network().InputOf(branch)]; };
    for (Index k = 0; k < num_states(); ++k) parts.x[k] = at(graph_.storages[AsSize(states_[AsSize(k)])].branch);
    for (Index k = 0; k < num_pairs(); ++k) parts.y[k] = sign_[k] * at(graph_.diodes[AsSize(k)].branch);
    for (Index k = 0; k < num_sources(); ++k) {
      parts.s[k] = graph_.sources[AsSize(k)].scale * at(graph_.sources[AsSize(k)].branch);
    }
    for (Index k = 0; k < num_excess(); ++k) parts.e[k] = at(graph_.storages[AsSize(excess_[AsSize(k)])].branch);
    return parts;
  }

  // Capacitances and inductances, states first, in units that make the diagonal 1: D = unit * normal * unit.
  void MakeStorageMatrix() {
    std::vector<Index> order = states_;
    order.insert(order.end(), excess_.begin(), excess_.end());
    const auto count = static_cast<Index>(order.size());
    storage_ = Matrix::Zero(count, count);
    const auto place_of = [&](Index element) {
      for (Index k = 0; k < count; ++k) {
        if (graph_.storages[AsSize(order[AsSize(k)])].element == element) return k;
      }
      return Index{-1};
    };
    for (Index k = 0; k < count; ++k)
      storage_(k, k) = ElementAt(graph_.storages[AsSize(order[AsSize(k)])].element).value;
    for (const Coupling& coupling : circuit_.couplings) {
      const Index one = place_of(coupling.first), other = place_of(coupling.second);
      const double mutual = coupling.value * std::sqrt(storage_(one, one) * storage_(other, other));
      storage_(one, other) = storage_(other, one) = mutual;
    }
  }

  // x~' = A x~ + K y + S s.
  absl::Status FindDynamics() {
    sign_.resize(num_pairs());
    for (Index k = 0; k < num_pairs(); ++k) sign_[k] = network().InTree(graph_.diodes[AsSize(k)].branch) ? -1 : 1;
    MakeStorageMatrix();
    if (absl::Status status = CheckCouplings(); !status.ok()) return status;
    const Index m = num_states(), e = num_excess();
    Matrix T = Matrix::Zero(m + e, m), Theta = Matrix::Zero(m + e, num_sources());
    T.topRows(m).setIdentity();
    for (Index k = 0; k < e; ++k) {
      const Parts own = PartsOf(Own(excess_[AsSize(k)]));
      T.row(m + k) = own.x;
      Theta.row(m + k) = own.s;
    }
    Matrix H(m, m), K(m, num_pairs()), S(m, num_sources()), Pi = Matrix::Zero(m, m + e);
    Pi.leftCols(m).setIdentity();
    for (Index k = 0; k < m; ++k) {
      const Parts drive = PartsOf(Drive(states_[AsSize(k)]));
      H.row(k) = drive.x;
      K.row(k) = drive.y;
      S.row(k) = drive.s;
      Pi.row(k).tail(e) = -drive.e;
    }
    const Matrix mass = Pi * storage_ * T;
    // In units that make the diagonal 1 where it is not 0.
    Vector unit = storage_.diagonal().head(m).cwiseSqrt();
    for (Index k = 0; k < m; ++k) {
      if (mass(k, k) > 0) unit[k] = std::sqrt(mass(k, k));
    }
    const Matrix scaled = unit.cwiseInverse().asDiagonal() * mass * unit.cwiseInverse().asDiagonal();
    Eigen::FullPivLU<Matrix> factors;
    if (m > 0) factors.compute(scaled);
    if (m > 0 && !(factors.matrixLU().diagonal().cwiseAbs().minCoeff() >
                   64 * std::numeric_limits<double>::epsilon() * static_cast<double>(m))) {
      return absl::InvalidArgumentError("the equations of " + NamesOfStorages() +
                                        " are dependent: their capacitances, inductances and couplings leave fewer "
                                        "states than there are elements, which is not supported");
    }
    const auto divided = [&](const Matrix& right) -> Matrix {
      if (m == 0 || mass.isDiagonal(0)) return mass.diagonal().cwiseInverse().asDiagonal() * right;
      return unit.cwiseInverse().asDiagonal() * factors.solve(Matrix(unit.cwiseInverse().asDiagonal() * right));
    };
    gamma_ = divided(Pi * storage_ * Theta);
    a_ = divided(H);
    b_ = divided(K);
    s_ = divided(S) - a_ * gamma_;  // x = x~ - Γ s
    // e = D_e (T x' + Θ s'), with x' = x~' - Γ s'.
    const Matrix excess = storage_.bottomRows(e) * T;
    e_x_ = excess * a_;
    e_y_ = excess * b_;
    e_s_ = excess * s_;
    e_ds_ = storage_.bottomRows(e) * Theta - excess * gamma_;
    // What cancels is zero.
    const Matrix terms = (storage_.bottomRows(e).cwiseAbs() * Theta.cwiseAbs()) + excess.cwiseAbs() * gamma_.cwiseAbs();
    for (Index k = 0; k < e_ds_.size(); ++k) {
      if (std::abs(e_ds_(k)) <= 1e-13 * terms(k)) e_ds_(k) = 0;
    }
    state_from_storage_ = divided(Pi * storage_);
    dependent_x_ = T.bottomRows(e);
    dependent_s_ = Theta.bottomRows(e);
    return absl::OkStatus();
  }

  absl::Status CheckCouplings() const {
    if (circuit_.couplings.empty()) return absl::OkStatus();
    const Vector unit = storage_.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix normal = unit.asDiagonal() * storage_ * unit.asDiagonal();
    const Eigen::LLT<Matrix> factors(normal);
    const double smallest = factors.matrixL().toDenseMatrix().diagonal().cwiseAbs().minCoeff();
    if (factors.info() == Eigen::Success && smallest * smallest > 1e-13) return absl::OkStatus();
    std::string names;
    for (const Coupling& coupling : circuit_.couplings) names += (names.empty() ? "" : ", ") + coupling.name;
    return absl::InvalidArgumentError("the couplings " + names +
                                      " together do not belong to coils: the inductance matrix is not positive "
                                      "definite. Make them smaller");
  }

  std::string NamesOfStorages() const {
    std::vector<Index> branches;
    for (const StorageBranch& storage : graph_.storages) branches.push_back(storage.branch);
    return ElementsOf(branches, graph_, circuit_);
  }

  // A row over the inputs of the network as a function of x~, y, the sources and their derivatives.
  LinearForm FormOf(const RowVector& row) const {
    const Parts parts = PartsOf(row);
    return {.x = parts.x + parts.e * e_x_,
            .y = parts.y + parts.e * e_y_,
            .s = parts.s - parts.x * gamma_ + parts.e * e_s_,
            .ds = parts.e * e_ds_};
  }

  // The gates of all switches, those first whose controls depend on no other gate.
  absl::Status FindGates() {
    std::vector<bool> found(AsSize(num_sources()));
    for (Index s = 0; s < num_sources(); ++s) found[AsSize(s)] = !graph_.sources[AsSize(s)].is_gate;
    for (bool progress = true; progress;) {
      progress = false;
      for (Index s = 0; s < num_sources(); ++s) {
        if (found[AsSize(s)]) continue;
        const Index switched = graph_.sources[AsSize(s)].element;
        const LinearForm control = ControlOf(ElementAt(switched));
        std::vector<ControlTerm> terms;
        bool ready = control.x.isZero(0) && control.y.isZero(0) && control.ds.isZero(0);
        for (Index k = 0; k < num_sources() && ready; ++k) {
          if (control.s[k] == 0) continue;
          ready = found[AsSize(k)];
          terms.push_back({control.s[k], graph_.sources[AsSize(k)].wave});
        }
        if (!ready) continue;
        const auto gate = GateOf(terms, ElementAt(switched).switching, circuit_.horizon);
        if (!gate.ok()) {
          return absl::InvalidArgumentError(WithPlace(ElementAt(switched)) +
                                            ": the times at which its control crosses "
                                            "its thresholds could not be found: " +
                                            std::string(gate.status().message()));
        }
        for (Index k = s; k < num_sources(); ++k) {
          if (graph_.sources[AsSize(k)].element != switched) continue;
          graph_.sources[AsSize(k)].wave = *gate;
          found[AsSize(k)] = true;
        }
        progress = true;
      }
    }
    for (Index s = 0; s < num_sources(); ++s) {
      if (found[AsSize(s)]) continue;
      return absl::InvalidArgumentError(
          WithPlace(ElementAt(graph_.sources[AsSize(s)].element)) +
          " is controlled by the circuit itself; supported are controls that independent sources alone determine, and "
          "its own voltage (a diode)");
    }
    return absl::OkStatus();
  }

  LinearForm ControlOf(const Element& element) const {
    if (element.control_element < 0) {
      return FormOf(network().Potential(element.control_plus) - network().Potential(element.control_minus));
    }
    return FormOf(CurrentOf(element.control_element));
  }

  RowVector CurrentOf(Index element) const {
    RowVector row = RowVector::Zero(network().num_inputs());
    for (const CircuitBranches::Part& part : graph_.parts[AsSize(element)]) {
      row += part.sign * network().Current(part.branch);
    }
    return row;
  }

  // The values of all sources at 0.
  Vector SourcesAtStart() const {
    Vector values(num_sources());
    for (Index s = 0; s < num_sources(); ++s) values[s] = StartValue(graph_.sources[AsSize(s)].wave);
    return values;
  }

  absl::Status FindStart() {
    const Vector s = SourcesAtStart();
    Vector z(num_states() + num_excess());
    std::vector<Index> order = states_;
    order.insert(order.end(), excess_.begin(), excess_.end());
    if (circuit_.uses_initial_conditions) {
      for (Index k = 0; k < z.size(); ++k)
        z[k] = GivenStart(ElementAt(graph_.storages[AsSize(order[AsSize(k)])].element));
    } else {
      Vector values = s;
      for (Index k = 0; k < num_sources(); ++k) values[k] *= graph_.sources[AsSize(k)].scale;
      const auto rest = FindOperatingPoint(circuit_, graph_, values);
      if (!rest.ok()) return rest.status();
      for (Index k = 0; k < z.size(); ++k) z[k] = (*rest)[order[AsSize(k)]];
    }
    // Charge and flux are kept.
    x0_ = state_from_storage_ * z;
    if (num_excess() == 0) x0_ = z;
    NoteJumps(z, s);
    return absl::OkStatus();
  }

  double GivenStart(const Element& element) const {
    if (element.initial) return *element.initial;
    if (element.kind != ElementKind::kCapacitor) return 0;
    const auto volts = [this](Index node) {
      for (const NodeVoltage& given : circuit_.node_voltages) {
        if (given.node == node) return given.volts;
      }
      return 0.0;
    };
    return volts(element.plus) - volts(element.minus);
  }

  // Initial values that do not fit together are an impulse at 0.
  void NoteJumps(const Vector& z, const Vector& s) {
    const Vector x = x0_ - gamma_ * s;
    const Vector dependent = dependent_x_ * x + dependent_s_ * s;
    const double size = 1e-9 * std::max(1e-300, z.cwiseAbs().sum() + dependent.cwiseAbs().sum());
    for (Index k = 0; k < num_excess(); ++k) {
      const double given = z[num_states() + k];
      if (std::abs(dependent[k] - given) <= size) continue;
      const Element& element = ElementAt(graph_.storages[AsSize(excess_[AsSize(k)])].element);
      const bool is_capacitor = element.kind == ElementKind::kCapacitor;
      notes_.push_back(WithPlace(element) + " jumps at 0 from " + FormatNumber(given) + " to " +
                       FormatNumber(dependent[k]) + (is_capacitor ? " V" : " A") +
                       ", since initial values and sources do not fit together; " + (is_capacitor ? "charge" : "flux") +
                       " is kept");
    }
  }

  // factors of the sources and of their derivatives, as a matrix times functions of time: 1, and the waveforms and
  // derivatives that occur and are not constant.
  TimeFunction FunctionOf(const Matrix& of_s, const Matrix& of_ds) const {
    struct Use {
      Index source;
      bool is_slope;
    };
    std::vector<Use> uses;
    Vector constant = Vector::Zero(of_s.rows());
    std::vector<Vector> columns;
    for (Index s = 0; s < num_sources(); ++s) {
      if (const auto* wave = std::get_if<ConstantWave>(&graph_.sources[AsSize(s)].wave)) {
        constant += of_s.col(s) * wave->value;
        continue;
      }
      if (const Index shared = SameGate(s, uses); shared >= 0) {
        columns[AsSize(shared)] += of_s.col(s);
      } else if (!of_s.col(s).isZero(0)) {
        uses.push_back({s, false});
        columns.emplace_back(of_s.col(s));
      }
      if (of_ds.col(s).isZero(0)) continue;
      uses.push_back({s, true});
      columns.emplace_back(of_ds.col(s));
    }
    if (uses.empty()) return TimeFunction::Constant(constant);

    TimeFunction function;
    Matrix lift(constant.size(), static_cast<Index>(uses.size()) + 1);
    lift.col(0) = constant;
    for (std::size_t k = 0; k < uses.size(); ++k) lift.col(static_cast<Index>(k) + 1) = columns[k];
    function.lift = lift;
    std::vector<double> cuts = {0, circuit_.horizon};
    for (const Use& use : uses) AddCuts(graph_.sources[AsSize(use.source)].wave, cuts);
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
      const double inside = cuts[k] + (cuts[k + 1] - cuts[k]) / 2;
      std::vector<std::string> formulas = {"1"};
      for (const Use& use : uses) {
        const Waveform& wave = graph_.sources[AsSize(use.source)].wave;
        formulas.push_back(use.is_slope ? DerivativeNear(wave, inside) : FormulaNear(wave, inside));
      }
      TimeFunction::Piece& piece = function.pieces.emplace_back();
      piece.start = cuts[k];
      piece.function.emplace<FormulaFunction>().formulas = std::move(formulas);
    }
    return function;
  }

  // The place in `uses` of a gate of the same switch, whose two valves have one gate; -1 if there is none.
  template <typename Uses>
  Index SameGate(Index s, const Uses& uses) const {
    const SourceBranch& source = graph_.sources[AsSize(s)];
    for (std::size_t k = 0; k < uses.size() && source.is_gate; ++k) {
      const SourceBranch& other = graph_.sources[AsSize(uses[k].source)];
      if (other.is_gate && other.element == source.element) return static_cast<Index>(k);
    }
    return -1;
  }

  // Those of `wave` merged into the increasing `cuts`; of times that are equal but for rounding only one.
  void AddCuts(const Waveform& wave, std::vector<double>& cuts) const {
    std::vector<double> all = Cuts(wave, circuit_.horizon);
    all.insert(all.end(), cuts.begin(), cuts.end());
    std::sort(all.begin(), all.end());
    cuts.clear();
    for (const double cut : all) {
      if (cuts.empty() || cut - cuts.back() > kSameTime * circuit_.horizon) cuts.push_back(cut);
    }
    cuts.back() = circuit_.horizon;
  }

  struct Rows {
    explicit Rows(Index rows, const Formulation& made)
        : x(rows, made.num_states()),
          y(rows, made.num_pairs()),
          s(rows, made.num_sources()),
          ds(rows, made.num_sources()) {}
    void Set(Index row, const LinearForm& form) {
      x.row(row) = form.x;
      y.row(row) = form.y;
      s.row(row) = form.s;
      ds.row(row) = form.ds;
    }
    Matrix x, y, s, ds;
  };

  absl::StatusOr<CircuitProblem> Assemble() {
    CircuitProblem made;
    Rows pairs(num_pairs(), *this);
    for (Index k = 0; k < num_pairs(); ++k) {
      const Index branch = graph_.diodes[AsSize(k)].branch;
      pairs.Set(k,
                FormOf(network().InTree(branch) ? network().Current(branch) : RowVector(-network().Voltage(branch))));
    }
    if (absl::Status status = RefuseImpulses(pairs); !status.ok()) return status;
    NoteDriven(pairs);
    Symmetrize(pairs.y);
    const Rows outputs = MakeOutputs(made.outputs.names);

    NoteImpulses(outputs);

    Problem& problem = made.problem;
    problem.A = a_;
    problem.B = b_;
    problem.N = pairs.x;
    problem.M = pairs.y;
    problem.f = FunctionOf(s_, Matrix::Zero(num_states(), num_sources()));
    problem.g = FunctionOf(pairs.s, pairs.ds);
    problem.x0 = x0_;
    problem.horizon = circuit_.horizon;
    made.outputs.x_factors = outputs.x;
    made.outputs.y_factors = outputs.y;
    made.outputs.sources = FunctionOf(outputs.s, outputs.ds);
    if (!IsFinite(made)) {
      return absl::InvalidArgumentError(
          "values of elements and sources are so large or small that the equations overflow");
    }
    for (const CircuitBranches::Limit& limit : graph_.limits) {
      made.limits.push_back({"i(" + ElementAt(limit.element).name + ")", limit.amperes});
    }
    MakeNames(made);
    if (num_states() == 0) AddIdleState(made);
    if (num_pairs() == 0) AddIdlePair(made);
    for (const std::string& note : graph_.notes) made.notes.push_back(note);
    for (const std::string& note : notes_) made.notes.push_back(note);
    return made;
  }

  static bool IsFinite(const CircuitProblem& made) {
    const auto is_finite = [](const TimeFunction& function) {
      if (function.is_lifted()) return function.lift.AllFinite();
      const auto* constant = std::get_if<ConstantFunction>(&function.pieces.front().function);
      return constant == nullptr || constant->value.allFinite();
    };
    const Problem& problem = made.problem;
    return problem.A.AllFinite() && problem.B.AllFinite() && problem.N.AllFinite() && problem.M.AllFinite() &&
           problem.x0.allFinite() && is_finite(problem.f) && is_finite(problem.g) && is_finite(made.outputs.sources) &&
           made.outputs.x_factors.allFinite() && made.outputs.y_factors.allFinite();
  }

  // A system needs a state: of a circuit of resistors it is one that stays 0.
  static void AddIdleState(CircuitProblem& made) {
    Problem& problem = made.problem;
    const Index n = problem.num_constraints();
    problem.A = Matrix::Zero(1, 1);
    problem.B = Matrix::Zero(1, n);
    problem.N = Matrix::Zero(n, 1);
    problem.f = TimeFunction::Zero(1);
    problem.x0 = Vector::Zero(1);
    made.outputs.x_factors = Matrix::Zero(made.outputs.y_factors.rows(), 1);
    made.state_names = {"idle"};
  }

  // A system needs a pair: of a circuit without diodes it is one that never acts, 0 <= y ⟂ 1 + y >= 0.
  static void AddIdlePair(CircuitProblem& made) {
    Problem& problem = made.problem;
    const Index m = problem.num_states();
    problem.B = Matrix::Zero(m, 1);
    problem.N = Matrix::Zero(1, m);
    problem.M = Matrix::Identity(1, 1);
    problem.g = TimeFunction::Constant(Vector::Ones(1));
    made.outputs.y_factors = Matrix::Zero(made.outputs.x_factors.rows(), 1);
    made.pair_names = {"idle_pair"};
  }

  // A source that jumps must not act on a pair by its derivative.
  absl::Status RefuseImpulses(const Rows& pairs) const {
    for (Index s = 0; s < num_sources(); ++s) {
      if (!HasJump(graph_.sources[AsSize(s)].wave, circuit_.horizon)) continue;
      for (Index k = 0; k < num_pairs(); ++k) {
        if (pairs.ds(k, s) == 0) continue;
        return absl::InvalidArgumentError(
            WithPlace(ElementAt(graph_.sources[AsSize(s)].element)) + " jumps, and " +
            WithPlace(ElementAt(graph_.diodes[AsSize(k)].element)) +
            " takes an impulse then, through a loop of capacitors or a cutset of inductors; give the source ramps");
      }
    }
    return absl::OkStatus();
  }

  // A diode whose voltage, or current, sources alone set has no solution while they drive it the wrong way.
  void NoteDriven(const Rows& pairs) {
    for (Index k = 0; k < num_pairs(); ++k) {
      const bool is_off = pairs.s.row(k).isZero(0) && pairs.ds.row(k).isZero(0);
      if (!pairs.x.row(k).isZero(0) || !pairs.y.row(k).isZero(0) || is_off) continue;
      const Index branch = graph_.diodes[AsSize(k)].branch;
      if (sign_[k] > 0) {
        notes_.push_back("nothing limits the current in the loop of " +
                         ElementsOf(network().Loop(branch), graph_, circuit_) +
                         ": while the diode would conduct there is no solution");
      } else {
        notes_.push_back("sources alone drive the current through " +
                         ElementsOf(network().Cutset(branch), graph_, circuit_) +
                         ": while it is against the diode there is no solution");
      }
    }
  }

  // Without controlled sources the network is reciprocal: M is symmetric between pairs of the same kind (y both
  // currents, or both voltages), skew between others. Rounding must not hide it.
  void Symmetrize(Matrix& M) const {
    for (const Branch& branch : graph_.branches) {
      if (branch.role == BranchRole::kControlledVoltage || branch.role == BranchRole::kControlledCurrent) return;
    }
    for (Index i = 0; i < M.rows(); ++i) {
      M(i, i) = std::max(0.0, M(i, i));
      for (Index j = 0; j < i; ++j) {
        const double sign = sign_[i] == sign_[j] ? 1 : -1;
        const double both = (M(i, j) + sign * M(j, i)) / 2;
        M(i, j) = both;
        M(j, i) = sign * both;
      }
    }
  }

  Rows MakeOutputs(std::vector<std::string>& names) const {
    const auto nodes = static_cast<Index>(circuit_.nodes.size()),
               elements = static_cast<Index>(circuit_.elements.size());
    Rows rows(nodes - 1 + elements, *this);
    for (Index node = 1; node < nodes; ++node) {
      names.push_back("v(" + circuit_.nodes[AsSize(node)] + ")");
      rows.Set(node - 1, FormOf(network().Potential(node)));
    }
    for (Index e = 0; e < elements; ++e) {
      names.push_back("i(" + ElementAt(e).name + ")");
      rows.Set(nodes - 1 + e, FormOf(CurrentOf(e)));
    }
    return rows;
  }

  void NoteImpulses(const Rows& outputs) {
    for (Index s = 0; s < num_sources(); ++s) {
      if (outputs.ds.col(s).isZero(0) || !HasJump(graph_.sources[AsSize(s)].wave, circuit_.horizon)) continue;
      notes_.push_back(WithPlace(ElementAt(graph_.sources[AsSize(s)].element)) +
                       " jumps, and charges capacitors (or magnetizes inductors) at once: outputs do not show these "
                       "impulses");
    }
  }

  void MakeNames(CircuitProblem& made) const {
    NameMaker names;
    for (Index k = 0; k < num_states(); ++k) {
      const StorageBranch& storage = graph_.storages[AsSize(states_[AsSize(k)])];
      const bool follows = !gamma_.row(k).isZero(0);
      made.state_names.push_back(names.Make(std::string(storage.is_capacitor ? "v" : "i") + (follows ? "0_" : "_") +
                                            ElementAt(storage.element).name));
    }
    for (const DiodeBranch& diode : graph_.diodes) made.pair_names.push_back(names.Make(diode.name));
  }

  const Circuit& circuit_;
  CircuitBranches graph_;
  std::variant<LinearNetwork, NetworkFault> network_ = NetworkFault();
  std::vector<Index> states_, excess_;  // of graph_.storages
  Vector sign_;                         // of each pair: 1 where y is the current, -1 where it is the reverse voltage
  Matrix storage_;
  Matrix gamma_, a_, b_, s_;
  Matrix e_x_, e_y_, e_s_, e_ds_;
  Matrix state_from_storage_, dependent_x_, dependent_s_;
  Vector x0_;
  std::vector<std::string> notes_;
};

}  // namespace

absl::StatusOr<CircuitProblem> MakeCircuitProblem(const Circuit& circuit) { return Formulation(circuit).Make(); }

}  // namespace dlcs
