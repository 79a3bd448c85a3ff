// SPDX-License-Identifier: Apache-2.0
// Compares manifests of Kubernetes with its published schemas: values with those that the package kubernetes-models has
// compiled; names of fields with its types, since the former let unknown fields pass. Usage:
// check_manifests.mjs FILE...
import fs from "node:fs";
import path from "node:path";
import process from "node:process";
import ts from "typescript";
import YAML from "yaml";

// [{where, text}] of all that is wrong in `files`.
async function findFaults(files) {
  const faults = [];
  const literals = new Map(); // of each object, as a program in TypeScript
  for (const file of files) {
    for (const document of YAML.parseAllDocuments(fs.readFileSync(file, "utf8"), {merge: true})) {
      for (const error of document.errors) faults.push(`${file}: ${error.message}`);
      const object = document.errors.length === 0 ? document.toJS() : null;
      if (object === null) continue;
      const where = `${file}: ${object.kind}`;
      const module = `kubernetes-models/${object.apiVersion}`;
      const models = await import(module).catch(() => ({}));
      const Model = models[object.kind];
      if (Model === undefined) {
        faults.push(`${where}: there is no such kind in ${object.apiVersion}`);
        continue;
      }
      try {
        new Model(object).validate();
      } catch (error) {
        faults.push(`${where}: ${error.message}`);
      }
      const name = path.resolve(`object-${literals.size}.ts`);
      const program = `import {type I${object.kind}} from "${module}";\n` +
        `export const object: I${object.kind} = ${JSON.stringify(object, null, 1)};\n`;
      literals.set(name, {where, program});
    }
  }
  return faults.concat(findUnknownFields(literals));
}

function findUnknownFields(literals) {
  const options = {
    module: ts.ModuleKind.NodeNext, moduleResolution: ts.ModuleResolutionKind.NodeNext, strict: true, noEmit: true,
    skipLibCheck: true, types: [],
  };
  const host = ts.createCompilerHost(options);
  const read = host.getSourceFile;
  const exists = host.fileExists;
  host.fileExists = (name) => literals.has(name) || exists(name);
  host.getSourceFile = (name, version) => literals.has(name)
    ? ts.createSourceFile(name, literals.get(name).program, version) : read(name, version);
  const program = ts.createProgram([...literals.keys()], options, host);
  return ts.getPreEmitDiagnostics(program).map((diagnostic) => {
    const text = ts.flattenDiagnosticMessageText(diagnostic.messageText, " ");
    const literal = literals.get(diagnostic.file?.fileName);
    return literal ? `${literal.where}: ${text}` : text;
  });
}

const faults = await findFaults(process.argv.slice(2));
for (const fault of faults) console.log(fault);
process.exitCode = faults.length === 0 ? 0 : 1;
