// SPDX-License-Identifier: Apache-2.0
// Problem files of deploy/examples, which the build puts in.

declare module 'examples' {
  const examples: {name: string; text: string}[];
  export default examples;
}
