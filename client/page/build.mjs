// SPDX-License-Identifier: Apache-2.0
// Bundles the page into dist, or the folder behind --out: index.html, and beside it a script, a style and an icon whose
// names hold a hash of their content, so that browsers may keep them forever. Nothing is fetched when the page runs.

import {build} from 'esbuild';
import {createHash} from 'node:crypto';
import {mkdir, readdir, readFile, rm, writeFile} from 'node:fs/promises';
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';
import {gzipSync} from 'node:zlib';

const here = dirname(fileURLToPath(import.meta.url));
const mostBytes = 150_000;
const examples = ['rectifier', 'named-rectifier', 'four-variables', 'four-variables-hard', 'oscillator-with-stop'];

const option = process.argv.indexOf('--out');
if (option >= 0 && process.argv[option + 1] === undefined) throw new Error('--out needs a folder');
const out = option >= 0 ? resolve(process.argv[option + 1]) : join(here, 'dist');

// The module "examples": the texts of some files of deploy/examples, with the line breaks that people see.
const withExamples = {
  name: 'examples',
  setup({onResolve, onLoad}) {
    onResolve({filter: /^examples$/}, () => ({path: 'examples', namespace: 'examples'}));
    onLoad({filter: /.*/, namespace: 'examples'}, async () => {
      const read = async (file) => {
        const text = await readFile(join(here, '../../deploy/examples', `${file}.json`), 'utf8');
        return {name: JSON.parse(text).name, text};
      };
      return {contents: JSON.stringify(await Promise.all(examples.map(read))), loader: 'json'};
    });
  },
};

const {outputFiles} = await build({
  entryPoints: [join(here, 'src/main.ts')],
  outdir: out,
  bundle: true,
  minify: true,
  write: false,
  format: 'esm',
  target: ['es2022'],
  legalComments: 'eof',
  plugins: [withExamples],
});

async function oldFiles() {
  const files = await readdir(out).catch(() => []);
  return files.filter((name) => /^(index\.html|page\.[0-9a-f]{12}\.(js|css|svg))$/.test(name));
}

await mkdir(out, {recursive: true});
for (const name of await oldFiles()) await rm(join(out, name));

let total = 0;
async function put(name, content) {
  total += gzipSync(content, {level: 9}).length;
  await writeFile(join(out, name), content);
  return name;
}

function hashed(content, extension) {
  return put(`page.${createHash('sha256').update(content).digest('hex').slice(0, 12)}.${extension}`, content);
}

const bundled = (extension) => outputFiles.find(({path}) => path.endsWith(extension)).contents;
const names = {
  script: await hashed(bundled('.js'), 'js'),
  style: await hashed(bundled('.css'), 'css'),
  icon: await hashed(await readFile(join(here, 'src/icon.svg')), 'svg'),
};
const page = await readFile(join(here, 'src/index.html'), 'utf8');
await put(
  'index.html',
  page.replace(/\{\{(\w+)\}\}/g, (_, name) => names[name]),
);
console.log(`${out}: ${Math.ceil(total / 1000)} KB gzipped`);
if (total > mostBytes) throw new Error(`the page has ${total} bytes gzipped; at most ${mostBytes} are allowed`);
