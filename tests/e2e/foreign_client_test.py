#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A client in another language: Debian's grpcio with stubs generated from proto/ alone.

Solves example 4.1 of Chen & Xiang on a real dlcsd and compares with the closed form, reads the order of the
events, and decodes the details of a refusal. Usage: foreign_client_test.py DLCSD PROTO_FOLDER
"""

import importlib
import json
import math
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import unittest

DLCSD = sys.argv[1]
PROTO = pathlib.Path(sys.argv[2])
STUBS = tempfile.TemporaryDirectory()


def generate_stubs():
    files = ["dlcs/v1/solver.proto", "google/rpc/error_details.proto", "google/rpc/status.proto"]
    plugin = subprocess.run(["which", "grpc_python_plugin"], check=True, capture_output=True, text=True).stdout.strip()
    subprocess.run(
        [
            "protoc",
            f"--proto_path={PROTO}",
            f"--python_out={STUBS.name}",
            f"--grpc_out={STUBS.name}",
            f"--plugin=protoc-gen-grpc={plugin}",
            *files,
        ],
        check=True,
    )
    sys.path.insert(0, STUBS.name)
    # The system's protobuf has a package google already; it must find ours too.
    import google

    google.__path__.append(str(pathlib.Path(STUBS.name) / "google"))


generate_stubs()
import grpc  # noqa: E402

pb = importlib.import_module("dlcs.v1.solver_pb2")
services = importlib.import_module("dlcs.v1.solver_pb2_grpc")
status_pb = importlib.import_module("google.rpc.status_pb2")
details_pb = importlib.import_module("google.rpc.error_details_pb2")


def dense(rows):
    return pb.Matrix(
        dense=pb.DenseMatrix(rows=len(rows), columns=len(rows[0]), values=[v for row in rows for v in row])
    )


def formulas(*texts):
    return pb.TimeFunction(pieces=[pb.TimePiece(formulas=pb.FormulaFunction(formulas=texts))])


def example_four_one():
    return pb.Problem(
        a=dense([[-1, 0], [0, -2]]),
        b=dense([[-3, 0, 0, 3], [0, 1.3, 1.3, 0]]),
        n=dense([[-1, 0], [0, 1], [0, 1], [1, 0]]),
        m=dense([[1, 0, 0, 0], [0, 0, -1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]),
        f=formulas("1.2*sin(10*t)", "0"),
        g=formulas("0", "0", "0", "0"),
        x0=[0, 1],
        horizon=1,
    )


def exact(t):
    return ((4.8 * math.sin(10 * t) - 12 * math.cos(10 * t)) / 116 + 3 / 29 * math.exp(-4 * t), math.exp(-2 * t))


class ForeignClientTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = subprocess.Popen(
            [DLCSD, "--listen", "127.0.0.1:0", "--reflection"],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        line = cls.server.stdout.readline()
        assert line.startswith("dlcsd listening on "), line
        cls.address = line.split()[-1]
        cls.channel = grpc.insecure_channel(cls.address)
        cls.stub = services.SolverServiceStub(cls.channel)

    @classmethod
    def tearDownClass(cls):
        cls.channel.close()
        cls.server.terminate()
        assert cls.server.wait(timeout=20) == 0
        cls.server.stdout.close()

    def test_solves_example_four_one(self):
        request = pb.SolveRequest(
            problem=example_four_one(), options=pb.SolveOptions(steps=4000, method=pb.METHOD_LAPLACE_ITERATION)
        )
        events = list(self.stub.Solve(request, timeout=60))
        kinds = [event.WhichOneof("kind") for event in events]
        self.assertEqual(kinds[:2], ["accepted", "analysis"])
        self.assertEqual(kinds[-1], "summary")
        self.assertIn("iterate", kinds)
        sequences = [event.sequence for event in events]
        self.assertEqual(sequences, sorted(set(sequences)))

        summary = events[-1].summary
        self.assertEqual(summary.termination, pb.TERMINATION_REACHED_END)
        self.assertEqual(summary.method, pb.METHOD_LAPLACE_ITERATION)
        self.assertLess(summary.certificate.node_residual, 1e-11)
        times, states, multipliers, slacks = [], [], [], []
        for event in events:
            if event.WhichOneof("kind") == "trajectory":
                self.assertEqual(event.trajectory.first, len(times))
                times += event.trajectory.times
                states += event.trajectory.x
                multipliers += event.trajectory.y
                slacks += event.trajectory.w
        self.assertEqual(len(times), 4001)
        self.assertEqual(summary.times, 4001)
        for k, t in enumerate(times):
            for computed, expected in zip(states[2 * k : 2 * k + 2], exact(t)):
                self.assertAlmostEqual(computed, expected, delta=1e-6)
            self.assertEqual(multipliers[4 * k + 1 : 4 * k + 3], [0, 0])  # the least element
        self.assertEqual(len(slacks), len(multipliers))
        for y, w in zip(multipliers, slacks):
            self.assertAlmostEqual(min(y, w), 0, delta=1e-11)
            self.assertAlmostEqual(y * w, 0, delta=1e-11)

    def test_located_events_are_complementary_bit_for_bit(self):
        options = pb.SolveOptions(error_tolerance=1e-8, method=pb.METHOD_EVENT_DRIVEN)
        events = list(self.stub.Solve(pb.SolveRequest(problem=example_four_one(), options=options), timeout=60))
        chunks = [event.trajectory for event in events if event.WhichOneof("kind") == "trajectory"]
        pairs = [pair for chunk in chunks for pair in zip(chunk.y, chunk.w)]
        self.assertEqual(len(pairs), 4 * events[-1].summary.times)
        self.assertTrue(all(y * w == 0 and min(y, w) == 0 for y, w in pairs))
        self.assertTrue(any(y > 0 for y, w in pairs) and any(w > 0 for y, w in pairs))
        for chunk in chunks:
            for k in range(len(chunk.times)):
                (x1, x2), y, w = chunk.x[2 * k : 2 * k + 2], chunk.y[4 * k : 4 * k + 4], chunk.w[4 * k : 4 * k + 4]
                for computed, expected in zip(w, (y[0] - x1, x2 - y[2], x2 - y[1], x1 + y[3])):
                    self.assertAlmostEqual(computed, expected, delta=1e-7)

    def test_solves_by_newtons_method(self):
        options = pb.SolveOptions(steps=100, output_times=[1], method=pb.METHOD_TIME_STEPPING)
        events = list(self.stub.Solve(pb.SolveRequest(problem=example_four_one(), options=options), timeout=60))
        self.assertFalse(events[-1].summary.HasField("newton"))
        substituted = [list(event.trajectory.x) for event in events if event.WhichOneof("kind") == "trajectory"][0]
        options.step_solver = pb.STEP_SOLVER_NEWTON
        events = list(self.stub.Solve(pb.SolveRequest(problem=example_four_one(), options=options), timeout=60))
        summary = events[-1].summary
        self.assertEqual(summary.cost.substituted_steps, 0)
        self.assertGreaterEqual(summary.cost.newton_iterations, 100)
        self.assertEqual(len(summary.newton.residuals), summary.cost.most_newton_iterations + 1)
        self.assertLess(summary.newton.residuals[-1], 1e-9 * summary.newton.residuals[0])
        for event in events:
            if event.WhichOneof("kind") == "trajectory":
                for one, other in zip(event.trajectory.x, substituted):
                    self.assertAlmostEqual(one, other, delta=1e-12)

    def test_takes_a_refusal_apart(self):
        problem = example_four_one()
        problem.x0.append(7)
        with self.assertRaises(grpc.RpcError) as caught:
            list(self.stub.Solve(pb.SolveRequest(problem=problem), timeout=60))
        self.assertEqual(caught.exception.code(), grpc.StatusCode.INVALID_ARGUMENT)
        metadata = dict(caught.exception.trailing_metadata())
        status = status_pb.Status.FromString(metadata["grpc-status-details-bin"])
        fields = []
        for detail in status.details:
            bad_request = details_pb.BadRequest()
            if detail.Unpack(bad_request):
                fields += [violation.field for violation in bad_request.field_violations]
        self.assertEqual(fields, ["problem.x0"])

    def test_every_error_says_its_reason(self):
        with self.assertRaises(grpc.RpcError) as caught:
            list(self.stub.Solve(pb.SolveRequest(), timeout=60))
        status = status_pb.Status.FromString(dict(caught.exception.trailing_metadata())["grpc-status-details-bin"])
        self.assertIn("one of problem, nonlinear and problem_name", status.message)
        info = details_pb.ErrorInfo()
        self.assertTrue(any(detail.Unpack(info) for detail in status.details))
        self.assertEqual((info.reason, info.domain), ("INVALID_REQUEST", "dlcs.v1"))

    def test_reflection_describes_the_services_that_it_lists(self):
        # Reads the messages without stubs: field 4 of the request is the symbol, and the response holds names of files.
        ask = self.channel.stream_stream(
            "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
            request_serializer=bytes,
            response_deserializer=bytes,
        )
        for service, file in [
            (b"dlcs.v1.SolverService", b"dlcs/v1/solver.proto"),
            (b"grpc.health.v1.Health", b"grpc/health/v1/health.proto"),
        ]:
            answers = list(ask(iter([b"\x22" + bytes([len(service)]) + service]), timeout=60))
            self.assertIn(file, answers[0])

    def test_analyzes_example_four_one(self):
        response = self.stub.AnalyzeProblem(pb.AnalyzeProblemRequest(problem=example_four_one()), timeout=60)
        self.assertEqual((response.states, response.constraints), (2, 4))
        self.assertIn("Z-matrix", response.matrix_class)
        self.assertIn("least element", response.rule)
        self.assertEqual(response.recommendation.options.error_tolerance, 1e-6)
        for section in response.sections:
            for finding in section.findings:
                self.assertNotEqual(finding.answer, pb.ANSWER_UNSPECIFIED)

    def test_solves_one_lcp(self):
        # 0 <= y ⟂ (-1, 2) + [2 1; 1 2] y >= 0: y = (1/2, 0).
        response = self.stub.SolveLcp(pb.SolveLcpRequest(m=dense([[2, 1], [1, 2]]), q=[-1, 2]), timeout=60)
        self.assertEqual(response.verdict, pb.LCP_STATUS_SOLVED)
        self.assertEqual(list(response.y), [0.5, 0])

    def test_lists_all_solutions_of_an_lcp(self):
        # y_1 + y_2 = 1, y >= 0: two basic solutions and what lies between them.
        request = pb.SolveLcpRequest(
            m=dense([[1, 1], [1, 1]]),
            q=[-1, -1],
            rule=pb.SOLUTION_RULE_MINIMIZER,
            selector=pb.Selector(c=dense([[1, 0]]), b=[0.25]),
            all_basic_solutions=True,
        )
        response = self.stub.SolveLcp(request, timeout=60)
        self.assertAlmostEqual(response.y[0], 0.25, delta=1e-12)
        self.assertAlmostEqual(response.y[1], 0.75, delta=1e-12)
        self.assertEqual(list(response.sets.j), [0, 1])
        self.assertTrue(response.all.complete)
        self.assertEqual(sorted(tuple(solution.y) for solution in response.all.solutions), [(0, 1), (1, 0)])
        self.assertEqual([list(face.basis) for face in response.all.faces], [[0, 1]])

    def test_solves_and_measures_a_dcp(self):
        # Example 10 of Shen & Pang: v = t (1, 1, 1)/4 is one solution, growing one component at a time another.
        m = dense([[1, 3, 0], [0, 1, 3], [3, 0, 1]])
        q = pb.PiecewiseLinearPath(times=[0, 1], values=[0, 0, 0, -1, -1, -1])
        solved = self.stub.SolveDcp(pb.SolveDcpRequest(m=m, q=q, max_step=0.125), timeout=60)
        self.assertTrue(solved.solved)
        self.assertEqual(solved.unique.answer, pb.ANSWER_UNKNOWN)
        for k, t in enumerate(solved.v.times):
            for value in solved.v.values[3 * k : 3 * k + 3]:
                self.assertAlmostEqual(value, t / 4, delta=1e-14)
        other = pb.PiecewiseLinearPath(times=[0])
        values = [[0, 0, 0]]
        for k in range(-30, 1):
            s = 2.0**k
            row = [0, 0, 0]
            row[k % 3], row[(k - 1) % 3], row[(k - 2) % 3] = s / 7, 4 * s / 7, 2 * s / 7
            other.times.append(s)
            values.append(row)
        other.values.extend(value for row in values for value in row)
        measured = self.stub.SolveDcp(pb.SolveDcpRequest(m=m, q=q, check=other), timeout=60)
        self.assertFalse(measured.HasField("v"))
        self.assertEqual(measured.certificate.start, 0)
        self.assertGreaterEqual(measured.certificate.least_increase, 0)
        self.assertGreaterEqual(measured.certificate.least_w, -1e-15)
        self.assertLess(measured.certificate.complementarity, 1e-15)
        self.assertNotAlmostEqual(other.values[-3], 0.25, delta=0.01)

    def test_curl_of_the_contracts_page_works(self):
        document = (PROTO / "README.md").read_text()
        with tempfile.TemporaryDirectory() as folder:
            body = re.search(r"^```json body.json\n(.*?)^```$", document, re.M | re.S)[1]
            (pathlib.Path(folder) / "body.json").write_text(body)
            store = pathlib.Path(folder) / "jobs.db"
            flags = ["--listen", "127.0.0.1:0", "--http-listen", "127.0.0.1:0", "--store", store]
            dlcsd = subprocess.Popen([DLCSD, *flags], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            try:
                dlcsd.stdout.readline()
                page = dlcsd.stdout.readline().split()[-1]
                commands = re.findall(r"^    (curl (?:.*\\\n)*.*)$", document, re.M)
                self.assertEqual(len(commands), 2)
                answers = []
                for command in commands:
                    words = shlex.split(command.replace("http://127.0.0.1:8080/", page))
                    run = subprocess.run(words, cwd=folder, check=True, capture_output=True, text=True, timeout=60)
                    answers.append([json.loads(line) for line in run.stdout.splitlines()])
            finally:
                dlcsd.kill()
                dlcsd.communicate()
        events, jobs = answers
        self.assertIn("accepted", events[0])
        self.assertEqual(events[-1]["summary"]["verdict"]["kind"], "VERDICT_KIND_SOLVED")
        self.assertEqual([event["trajectory"]["times"] for event in events if "trajectory" in event], [[0, 1, 2]])
        self.assertEqual(jobs, [{"jobs": [], "next_page_token": ""}])

    def test_the_client_of_the_document_prints_what_is_shown(self):
        document = (PROTO / "README.md").read_text()
        program = re.search(r"^```python solve.py\n(.*?)^```$", document, re.M | re.S)[1]
        shown = re.search(r"^    \$ \S*python3 solve.py\n((?:    .*\n)+)", document, re.M)[1]
        for old, new in (('"stubs"', repr(STUBS.name)), ("localhost:50051", self.address)):
            self.assertIn(old, program)
            program = program.replace(old, new)
        run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
        self.assertEqual(run.stderr, "")
        first, *others = run.stdout.split("\n")
        self.assertTrue(first.startswith("SOLVED within an error of 1e-09, estimated error "), first)
        self.assertEqual([line.split() for line in others if line], [line.split() for line in shown.splitlines()[1:]])

    def test_solves_a_nonlinear_problem(self):
        # x1' = -x1 + y1, 0 <= y1 and y1 + y1^3 + x1 - 1 >= 0 complementary: y1 = 0 and x1 = 2 e^{-t} while x1 >= 1.
        problem = pb.NonlinearProblem(f=["-x1+y1"], g=["y1+y1**3+x1-1"], x0=[2], horizon=2)
        request = pb.SolveRequest(nonlinear=problem, options=pb.SolveOptions(steps=500, output_times=[0.5, 2]))
        events = list(self.stub.Solve(request, timeout=60))
        kinds = [event.WhichOneof("kind") for event in events]
        self.assertEqual(kinds[-1], "summary")
        self.assertIn("iterate", kinds)
        self.assertEqual(events[-1].summary.termination, pb.TERMINATION_REACHED_END)
        chunk = events[kinds.index("trajectory")].trajectory
        self.assertEqual(list(chunk.times), [0.5, 2])
        self.assertAlmostEqual(chunk.x[0], 2 * math.exp(-0.5), delta=1e-6)
        x, y = chunk.x[1], chunk.y[1]
        self.assertGreater(y, 0)
        self.assertAlmostEqual(y + y**3 + x - 1, 0, delta=1e-9)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
