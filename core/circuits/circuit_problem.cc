// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/circuit_problem.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>

#include "core/circuits/circuit_branches.h"
#include "core/circuits/circuit_names.h"
#include "core/circuits/circuit_states.h"
#include "core/circuits/element_faults.h"
#include "core/circuits/first_branch.h"
#include "core/circuits/floating_nodes.h"
#include "core/circuits/gate.h"
#include "core/circuits/operating_point.h"
#include "core/circuits/solution_blocks.h"
#include "core/circuits/source_terms.h"
#include "core/circuits/variable_names.h"
#include "core/format_number.h"
#include "core/lcp/basis/tolerance.h"
#include "core/matrix_classes/matrix_class.h"
#include "core/problem/time_axis.h"

namespace dlcs {
namespace {

class Formulation {
 public:
  explicit Formulation(const Circuit& circuit)
      : circuit_(circuit), in_loop_(circuit.elements.size()), states_(circuit_, graph_) {}

  absl::StatusOr<CircuitProblem> Make() {
    if (absl::Status status = CheckElements(circuit_); !status.ok()) return status;
    // The equations show which switches the circuit itself controls, and these switches change the equations.
    for (bool changed = true; changed;) {
      if (absl::Status status = FindStates(); !status.ok()) return status;
      const auto found = FindGates();
      if (!found.ok()) return found.status();
      changed = !*found;
    }
    if (absl::Status status = FindStart(); !status.ok()) return status;
    return Assemble();
  }

 private:
  const Element& ElementAt(Index index) const { return circuit_.elements[AsSize(index)]; }

  // Tries other windings as ports of ideal transformers if the bases give no states.
  absl::Status FindStates() {
    graph_ = MakeBranches(circuit_, in_loop_, ports_);
    const absl::Status status = states_.Find();
    if (status.ok()) return status;
    const auto count = static_cast<Index>(circuit_.elements.size());
    std::vector<std::vector<Index>> cores;  // their windings, the base first
    for (Index e = 0; e < count; ++e) {
      std::vector<Index> windings;
      for (Index other = e; other < count; ++other) {
        if (graph_.windings[AsSize(other)].base == e) windings.push_back(other);
      }
      if (windings.size() > 1) cores.push_back(std::move(windings));
    }
    constexpr std::size_t kMaxChoices = 1024;
    std::size_t choices = 1;
    for (const auto& windings : cores) choices = std::min(kMaxChoices, choices * windings.size());
    for (std::size_t choice = 0; choice < choices && !cores.empty(); ++choice) {
      ports_.resize(circuit_.elements.size());
      std::size_t rest = choice;
      for (const auto& windings : cores) {
        ports_[AsSize(windings.front())] = windings[rest % windings.size()];
        rest /= windings.size();
      }
      graph_ = MakeBranches(circuit_, in_loop_, ports_);
      if (states_.Find().ok()) return absl::OkStatus();
    }
    return status;
  }

  // Switches with the same control and model have the same gate.
  struct KnownGate {
    Eigen::RowVectorXd control;  // by the sources
    const SwitchModel* model;
    Waveform gate;
  };

  // The gates of all switches that sources control, those first whose controls depend on no other gate. False if there
  // are others, which then are in `in_loop_`.
  absl::StatusOr<bool> FindGates() {
    std::vector<bool> found(AsSize(states_.num_sources()));
    std::vector<KnownGate> known;
    for (Index s = 0; s < states_.num_sources(); ++s) found[AsSize(s)] = !graph_.sources[AsSize(s)].is_gate;
    for (bool progress = true; progress;) {
      progress = false;
      for (Index s = 0; s < states_.num_sources(); ++s) {
        if (found[AsSize(s)]) continue;
        const Index switched = graph_.sources[AsSize(s)].element;
        const LinearForm control = states_.SumOf(ElementAt(switched).controls);
        std::vector<ControlTerm> terms;
        bool ready = control.x.isZero(0) && control.y.isZero(0) && control.ds.isZero(0);
        for (Index k = 0; k < states_.num_sources() && ready; ++k) {
          if (control.s[k] == 0) continue;
          ready = found[AsSize(k)];
          terms.push_back({control.s[k], graph_.sources[AsSize(k)].wave});
        }
        if (!ready) continue;
        const SwitchModel& model = ElementAt(switched).switching;
        auto same = std::find_if(known.begin(), known.end(), [&](const KnownGate& one) {
          const SwitchModel& other = *one.model;
          return one.control == control.s && other.threshold == model.threshold &&
                 other.hysteresis == model.hysteresis && other.starts_closed == model.starts_closed;
        });
        if (same == known.end()) {
          auto gate = GateOf(terms, model, circuit_.horizon);
          if (!gate.ok()) {
            return absl::InvalidArgumentError(WithPlace(ElementAt(switched)) +
                                              ": the times at which its control crosses "
                                              "its thresholds could not be found: " +
                                              std::string(gate.status().message()));
          }
          same = known.insert(known.end(), {control.s, &model, *std::move(gate)});
        }
        for (Index k = s; k < states_.num_sources(); ++k) {
          if (graph_.sources[AsSize(k)].element != switched || !graph_.sources[AsSize(k)].is_gate) continue;
          graph_.sources[AsSize(k)].wave = same->gate;
          found[AsSize(k)] = true;
        }
        progress = true;
      }
    }
    for (Index s = 0; s < states_.num_sources(); ++s) {
      if (found[AsSize(s)]) continue;
      const Index switched = graph_.sources[AsSize(s)].element;
      if (absl::Status status = RefuseAnalog(switched); !status.ok()) return status;
      in_loop_[AsSize(switched)] = true;
    }
    return std::find(found.begin(), found.end(), false) == found.end();
  }

  // A transistor whose gate follows what its own circuit does may be an amplifier.
  absl::Status RefuseAnalog(Index switched) const {
    const Element& element = ElementAt(switched);
    if (!element.switching.is_transistor) return absl::OkStatus();
    const LinearForm control = states_.SumOf(element.controls);
    std::vector<Index> branches;
    const std::vector<Index> order = states_.Storages();
    for (Index k = 0; k < states_.num_states(); ++k) {
      if (control.x[k] != 0) branches.push_back(graph_.storages[AsSize(order[AsSize(k)])].branch);
    }
    for (Index k = 0; k < states_.num_pairs(); ++k) {
      const bool is_clamp = std::any_of(graph_.clamps.begin(), graph_.clamps.end(),
                                        [k](const ClampBranches& clamp) { return clamp.low == k || clamp.high == k; });
      if (control.y[k] != 0 && !is_clamp) branches.push_back(graph_.diodes[AsSize(k)].branch);
    }
    if (branches.empty()) return absl::OkStatus();
    return absl::InvalidArgumentError(
        WithPlace(element) + ": its gate voltage depends on " + ElementsOf(branches, graph_, circuit_) +
        ", so it may be an amplifier; a transistor is a switch whose gate independent sources or comparators drive. "
        "Drive it from its gate to its source, or replace it by a switch S");
  }

  // The values of all sources at 0.
  Vector SourcesAtStart() const {
    Vector values(states_.num_sources());
    for (Index s = 0; s < states_.num_sources(); ++s) values[s] = StartValue(graph_.sources[AsSize(s)].wave);
    return values;
  }

  absl::Status FindStart() {
    const Vector s = SourcesAtStart();
    Vector z(states_.num_states() + states_.num_excess());
    const std::vector<Index> order = states_.Storages();
    if (circuit_.uses_initial_conditions) {
      for (Index k = 0; k < z.size(); ++k) z[k] = GivenStart(graph_.storages[AsSize(order[AsSize(k)])].element);
    } else {
      Vector values = s;
      for (Index k = 0; k < states_.num_sources(); ++k) values[k] *= graph_.sources[AsSize(k)].scale;
      // At rest every winding is a short, whichever of them is the port. The order of all branches stays the same.
      const auto rest = FindOperatingPoint(circuit_, MakeBranches(circuit_, in_loop_), values);
      if (!rest.ok()) return rest.status();
      for (Index k = 0; k < z.size(); ++k) z[k] = rest->storages[order[AsSize(k)]];
      notes_.insert(notes_.end(), rest->notes.begin(), rest->notes.end());
    }
    // Charge and flux are kept.
    x0_ = states_.StartOf(z);
    NoteJumps(z, s);
    return absl::OkStatus();
  }

  // The initial current of an inductor. If it has other windings: the current that makes the flux of all of them.
  double GivenStart(Index index) const {
    const Element& element = ElementAt(index);
    if (element.kind == ElementKind::kInductor) {
      double amperes = 0;
      for (Index e = 0; e < static_cast<Index>(circuit_.elements.size()); ++e) {
        const CircuitBranches::Winding& winding = graph_.windings[AsSize(e)];
        if (winding.base == index) amperes += winding.ratio * ElementAt(e).initial.value_or(0);
      }
      return amperes;
    }
    if (element.initial) return *element.initial;
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
    const Vector dependent = states_.Dependent(x0_, s);
    const std::vector<Index> order = states_.Storages();
    const double size = kSameResult * std::max(1e-300, z.cwiseAbs().sum() + dependent.cwiseAbs().sum());
    for (Index k = 0; k < states_.num_excess(); ++k) {
      const double given = z[states_.num_states() + k];
      if (std::abs(dependent[k] - given) <= size) continue;
      const Element& element = ElementAt(graph_.storages[AsSize(order[AsSize(states_.num_states() + k)])].element);
      const bool is_capacitor = element.kind == ElementKind::kCapacitor;
      notes_.push_back(WithPlace(element) + " jumps at 0 from " + FormatNumber(given) + " to " +
                       FormatNumber(dependent[k]) + (is_capacitor ? " V" : " A") +
                       ", since initial values and sources do not fit together; " + (is_capacitor ? "charge" : "flux") +
                       " is kept");
    }
  }

  TimeFunction FunctionOf(const Matrix& of_s, const Matrix& of_ds) const {
    return FunctionOfSources(graph_.sources, of_s, of_ds, circuit_.horizon);
  }

  struct Rows {
    explicit Rows(Index rows, const CircuitStates& made)
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
    Rows pairs(states_.num_pairs(), states_);
    for (Index k = 0; k < states_.num_pairs(); ++k) {
      const Index branch = graph_.diodes[AsSize(k)].branch;
      pairs.Set(
          k, states_.FormOf(states_.network().InTree(branch) ? states_.network().Current(branch)
                                                             : Eigen::RowVectorXd(-states_.network().Voltage(branch))));
    }
    if (absl::Status status = RefuseImpulses(pairs); !status.ok()) return status;
    NoteDriven(pairs);
    NoteInterrupters(pairs);
    MakeReciprocal(graph_, states_.sign(), pairs.y);
    const Rows outputs = MakeOutputs(made.outputs.names);

    if (absl::Status status = RefuseDerivatives(pairs, outputs); !status.ok()) return status;
    NoteImpulses(outputs);

    Problem& problem = made.problem;
    problem.A = states_.A();
    problem.B = states_.B();
    problem.N = pairs.x;
    problem.M = pairs.y;
    problem.f = FunctionOf(states_.S(), Matrix::Zero(states_.num_states(), states_.num_sources()));
    problem.g = FunctionOf(pairs.s, pairs.ds);
    problem.x0 = x0_;
    problem.horizon = circuit_.horizon;
    if (absl::Status status = FindFirstBranch(problem); !status.ok()) return status;
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
    made.relays = MakeRelays();
    MakeNames(made);
    if (states_.num_states() == 0) AddIdleState(made);
    if (states_.num_pairs() == 0) AddIdlePair(made);
    for (const std::string& note : graph_.notes) made.notes.push_back(note);
    for (const std::string& note : notes_) made.notes.push_back(note);
    for (std::string& note : NotesOnFloatingNodes(circuit_)) made.notes.push_back(std::move(note));
    return made;
  }

  std::vector<Relay> MakeRelays() const {
    std::vector<Relay> relays;
    const auto one_way = [this](Index pair) { return Relay::OneWay{pair, states_.sign()[pair] > 0}; };
    for (const ClampBranches& clamp : graph_.clamps) {
      if (!clamp.is_jump || clamp.low < 0 || clamp.high < 0) continue;
      const Element& element = ElementAt(clamp.element);
      const bool has_hysteresis = clamp.is_gate && element.switching.hysteresis != 0;
      relays.push_back({element.name, clamp.is_gate, has_hysteresis, one_way(clamp.low), one_way(clamp.high)});
    }
    return relays;
  }

  // Comparators with feedback, and amplifiers, may have several solutions: history chooses, from the first one on.
  absl::Status FindFirstBranch(Problem& problem) {
    const Matrix& M = problem.M.Dense();
    const Index n = M.rows();
    if (n == 0 || graph_.clamps.empty() || !M.allFinite()) return absl::OkStatus();
    const MatrixClass known = Classify(M);
    if (known.p.yes() || known.positive_semidefinite.yes()) return absl::OkStatus();
    problem.rule = SolutionRule::kHistory;
    // There may be a piece for each time at which a switch acts.
    const TimeFunction at_start{.pieces = {problem.g.pieces.front()}, .lift = problem.g.lift};
    const double end = problem.g.pieces.size() > 1 ? problem.g.pieces[1].start : problem.horizon;
    const TimeAxis axis{end, BreakPoints(at_start, end)};
    auto evaluator = TimeFunctionEvaluator::Create(at_start, n, axis);
    if (!evaluator.ok()) return evaluator.status();
    Vector g(n);
    evaluator->Evaluate(axis.Nearest(0), Side::kRight, g);
    const Matrix& N = problem.N.Dense();
    const Vector tolerance = kWorkingPrecision * (g.cwiseAbs() + N.cwiseAbs() * x0_.cwiseAbs());
    const BlockSolutions solutions =
        SolveByBlocks(M, g + N * x0_, tolerance, Matrix(0, n), graph_.clamps, states_.sign());
    if (!solutions.undecided.empty()) {
      return absl::InvalidArgumentError(
          "which solution the circuit starts with could not be decided: too much feedback between " +
          ElementsOfPairs(solutions.undecided, circuit_, graph_) +
          ", which depend on each other at once. A small capacitor or inductor between them separates them");
    }
    if (solutions.all.empty()) {
      return absl::InvalidArgumentError(
          "there is no solution at 0: no voltages and currents of diodes, switches and comparators fit the initial "
          "values and the sources at 0; give others with IC= or .ic");
    }
    const BranchVoltages voltages = VoltagesAtStart();
    const std::vector<Index> starts = PossibleStarts(solutions.all, voltages, circuit_, graph_);
    if (starts.size() > 1) {
      return absl::InvalidArgumentError(
          "there are several solutions at 0, which differ in " +
          ElementsThatDiffer(solutions.all, starts, voltages, circuit_, graph_) +
          ": history chooses one of them, so give a voltage at 0 that is different in them with .ic V(node)=...");
    }
    problem.y0 = Vector::Zero(n);
    for (Index i = 0; i < n; ++i) (*problem.y0)[i] = solutions.all[AsSize(starts.front())].basis[AsSize(i)] ? 1 : 0;
    return absl::OkStatus();
  }

  BranchVoltages VoltagesAtStart() const {
    std::vector<Index> nodes;
    for (const ClampBranches& clamp : graph_.clamps) nodes.push_back(clamp.node);
    for (const NodeVoltage& given : circuit_.node_voltages) nodes.push_back(given.node);
    const Vector s = SourcesAtStart();
    BranchVoltages voltages{Matrix(static_cast<Index>(nodes.size()), states_.num_pairs()),
                            Vector(static_cast<Index>(nodes.size()))};
    for (Index k = 0; k < voltages.constant.size(); ++k) {
      const LinearForm form = states_.PotentialOf(nodes[AsSize(k)]);
      voltages.of_y.row(k) = form.y;
      voltages.constant[k] = form.x.dot(x0_.transpose()) + form.s.dot(s.transpose());
    }
    return voltages;
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
    for (Index s = 0; s < states_.num_sources(); ++s) {
      if (!HasJump(graph_.sources[AsSize(s)].wave, circuit_.horizon)) continue;
      for (Index k = 0; k < states_.num_pairs(); ++k) {
        if (pairs.ds(k, s) == 0) continue;
        return absl::InvalidArgumentError(
            WithPlace(ElementAt(graph_.sources[AsSize(s)].element)) + " jumps, and " +
            WithPlace(ElementAt(graph_.diodes[AsSize(k)].element)) +
            " takes an impulse then, through a loop of capacitors or a cutset of inductors; give the source ramps");
      }
    }
    return absl::OkStatus();
  }

  // A source must not drive capacitors or inductors directly if its derivative is not known.
  absl::Status RefuseDerivatives(const Rows& pairs, const Rows& outputs) const {
    for (Index s = 0; s < states_.num_sources(); ++s) {
      const SourceBranch& source = graph_.sources[AsSize(s)];
      if (HasDerivative(source.wave) || (pairs.ds.col(s).isZero(0) && outputs.ds.col(s).isZero(0))) continue;
      return absl::InvalidArgumentError(
          WithPlace(ElementAt(source.element)) +
          " is in a loop with capacitors alone, or in a cutset with inductors alone, which needs the derivative of its "
          "expression: write it as SIN, PULSE, PWL, EXP, SFFM or AM, or put a resistance between them");
    }
    return absl::OkStatus();
  }

  // If sources alone set the voltage or the current of a diode, there is no solution while they drive it the wrong way.
  void NoteDriven(const Rows& pairs) {
    for (Index k = 0; k < states_.num_pairs(); ++k) {
      const bool is_off = pairs.s.row(k).isZero(0) && pairs.ds.row(k).isZero(0);
      if (!pairs.x.row(k).isZero(0) || !pairs.y.row(k).isZero(0) || is_off) continue;
      const Index branch = graph_.diodes[AsSize(k)].branch;
      if (states_.sign()[k] > 0) {
        notes_.push_back("nothing limits the current in the loop of " +
                         ElementsOf(states_.network().Loop(branch), graph_, circuit_) +
                         ": while the diode would conduct there is no solution");
      } else {
        notes_.push_back("sources alone drive the current through " +
                         ElementsOf(states_.network().Cutset(branch), graph_, circuit_) +
                         ": while it is against the diode there is no solution");
      }
    }
  }

  // A switch that alone carries the current of an inductor.
  void NoteInterrupters(const Rows& pairs) {
    for (Index k = 0; k < states_.num_pairs(); ++k) {
      const Index element = graph_.diodes[AsSize(k)].element;
      if (ElementAt(element).kind != ElementKind::kSwitch || states_.sign()[k] > 0) continue;
      if (pairs.x.row(k).isZero(0) || !pairs.y.row(k).isZero(0)) continue;
      std::vector<Index> branches;
      const std::vector<Index> order = states_.Storages();
      for (Index j = 0; j < states_.num_states(); ++j) {
        if (pairs.x(k, j) != 0) branches.push_back(graph_.storages[AsSize(order[AsSize(j)])].branch);
      }
      std::string note = WithPlace(ElementAt(element)) + " alone carries the current of " +
                         ElementsOf(branches, graph_, circuit_) +
                         ": while it flows the switch cannot open. Give the current another path, a diode or a snubber";
      if (std::find(notes_.begin(), notes_.end(), note) == notes_.end()) notes_.push_back(std::move(note));
    }
  }

  Rows MakeOutputs(std::vector<std::string>& names) const {
    const auto nodes = static_cast<Index>(circuit_.nodes.size()),
               elements = static_cast<Index>(circuit_.elements.size());
    Rows rows(nodes - 1 + elements, states_);
    for (Index node = 1; node < nodes; ++node) {
      names.push_back("v(" + circuit_.nodes[AsSize(node)] + ")");
      rows.Set(node - 1, states_.PotentialOf(node));
    }
    for (Index e = 0; e < elements; ++e) {
      names.push_back("i(" + ElementAt(e).name + ")");
      rows.Set(nodes - 1 + e, states_.CurrentOf(e));
    }
    return rows;
  }

  void NoteImpulses(const Rows& outputs) {
    for (Index s = 0; s < states_.num_sources(); ++s) {
      if (outputs.ds.col(s).isZero(0) || !HasJump(graph_.sources[AsSize(s)].wave, circuit_.horizon)) continue;
      notes_.push_back(WithPlace(ElementAt(graph_.sources[AsSize(s)].element)) +
                       " jumps, and charges capacitors (or magnetizes inductors) at once: outputs do not show these "
                       "impulses");
    }
  }

  void MakeNames(CircuitProblem& made) const {
    VariableNames names;
    const std::vector<Index> order = states_.Storages();
    for (Index k = 0; k < states_.num_states(); ++k) {
      const StorageBranch& storage = graph_.storages[AsSize(order[AsSize(k)])];
      const bool follows = !states_.Gamma().row(k).isZero(0);
      made.state_names.push_back(names.Make(std::string(storage.is_capacitor ? "v" : "i") + (follows ? "0_" : "_") +
                                            ElementAt(storage.element).name));
    }
    for (const DiodeBranch& diode : graph_.diodes) made.pair_names.push_back(names.Make(diode.name));
  }

  const Circuit& circuit_;
  std::vector<bool> in_loop_;  // by element: a switch that the circuit itself controls
  std::vector<Index> ports_;   // of ideal transformers; empty: their bases
  CircuitBranches graph_;
  CircuitStates states_;
  Vector x0_;
  std::vector<std::string> notes_;
};

}  // namespace

absl::StatusOr<CircuitProblem> MakeCircuitProblem(const Circuit& circuit) { return Formulation(circuit).Make(); }

Outputs CombinedOutputs(const CircuitOutputs& all, const Matrix& rows, const Vector& constants) {
  Outputs outputs;
  // Most rows choose one output.
  const Eigen::SparseMatrix<double, Eigen::RowMajor> few = rows.sparseView();
  outputs.C = Matrix(few * all.x_factors);
  outputs.D = Matrix(few * all.y_factors);
  outputs.h = RowsOf(all.sources, rows, constants);
  return outputs;
}

}  // namespace dlcs
