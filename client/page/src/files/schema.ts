// SPDX-License-Identifier: Apache-2.0
// Checks a value against a JSON schema: the part of draft 7 that the schemas of problem files use. Of several forms
// (oneOf) the errors are those of the form that the value comes nearest to.

import {describe, isObject, type Json, type JsonObject, type Path} from './json';

export interface FieldError {
  path: Path;
  /** What the value is and what it must be, to be read after the path. */
  rule: string;
}

const mostErrors = 20;

export class Schemas {
  /** By the names that references between them use. */
  constructor(private readonly files: {[name: string]: JsonObject}) {}

  check(value: Json, name: string): FieldError[] {
    return new Check(this.files).run(value, name);
  }
}

class Check {
  constructor(private readonly files: {[name: string]: JsonObject}) {}

  run(value: Json, name: string): FieldError[] {
    return this.value(value, this.files[name], name, []).slice(0, mostErrors);
  }

  private value(value: Json, schema: JsonObject, file: string, path: Path): FieldError[] {
    if (typeof schema.$ref === 'string') {
      const [other, pointer] = schema.$ref.split('#');
      const home = other === '' ? file : other;
      let target: Json = this.files[home];
      for (const step of pointer.split('/').slice(1)) target = (target as JsonObject)[step];
      return this.value(value, target as JsonObject, home, path);
    }
    const own = this.kind(value, schema, path);
    if (own !== null) return [own];
    const errors: FieldError[] = [];
    if (Array.isArray(value)) this.list(value, schema, file, path, errors);
    if (isObject(value)) this.object(value, schema, file, path, errors);
    if (typeof value === 'number') this.number(value, schema, path, errors);
    if (typeof value === 'string' && typeof schema.pattern === 'string' && !new RegExp(schema.pattern).test(value)) {
      errors.push({path, rule: `is ${describe(value)}; must match ${schema.pattern}`});
    }
    if (schema.oneOf !== undefined) errors.push(...this.oneOf(value, schema.oneOf as JsonObject[], file, path));
    // In these schemas `not` only distinguishes two forms; what it excludes is valid in the other form.
    if (isObject(schema.not) && this.value(value, schema.not, file, path).length === 0) {
      errors.push({path, rule: 'is of a form that is not allowed here'});
    }
    return errors;
  }

  private kind(value: Json, schema: JsonObject, path: Path): FieldError | null {
    if (schema.type !== undefined) {
      const types = [schema.type].flat() as string[];
      if (!types.some((type) => isA(value, type))) {
        return {path, rule: `is ${describe(value)}; must be ${wanted(schema, types)}`};
      }
    }
    if (schema.const !== undefined && value !== schema.const) {
      return {path, rule: `is ${describe(value)}; must be ${JSON.stringify(schema.const)}`};
    }
    if (Array.isArray(schema.enum) && !schema.enum.includes(value)) {
      return {path, rule: `is ${describe(value)}; must be one of ${schema.enum.join(', ')}`};
    }
    return null;
  }

  private list(value: Json[], schema: JsonObject, file: string, path: Path, errors: FieldError[]): void {
    const {items, minItems, maxItems} = schema;
    if (typeof minItems === 'number' && value.length < minItems) {
      errors.push({path, rule: `is ${describe(value)}; must hold at least ${minItems}`});
    }
    if (typeof maxItems === 'number' && value.length > maxItems) {
      errors.push({path, rule: `is ${describe(value)}; must hold at most ${maxItems}`});
    }
    if (schema.uniqueItems === true) {
      const seen = new Set<string>();
      value.forEach((item, i) => {
        const text = JSON.stringify(item);
        if (seen.has(text)) errors.push({path: [...path, i], rule: `is ${describe(item)}, which is in the list twice`});
        seen.add(text);
      });
    }
    if (items === undefined) return;
    for (let i = 0; i < value.length && errors.length < mostErrors; ++i) {
      const item = Array.isArray(items) ? items[i] : items;
      if (isObject(item)) errors.push(...this.value(value[i], item, file, [...path, i]));
    }
  }

  private object(value: JsonObject, schema: JsonObject, file: string, path: Path, errors: FieldError[]): void {
    const properties = (schema.properties ?? {}) as {[key: string]: JsonObject};
    for (const key of (schema.required ?? []) as string[]) {
      if (Object.hasOwn(value, key)) continue;
      const about = properties[key]?.description;
      errors.push({path, rule: `has no "${key}"${typeof about === 'string' ? `; it must hold ${about}` : ''}`});
    }
    for (const [key, inside] of Object.entries(value)) {
      if (errors.length >= mostErrors) return;
      const place = [...path, key];
      if (isObject(schema.propertyNames) && this.value(key, schema.propertyNames, file, place).length > 0) {
        errors.push({path: place, rule: 'is not a possible key here'});
      } else if (Object.hasOwn(properties, key)) {
        errors.push(...this.value(inside, properties[key], file, place));
      } else if (schema.additionalProperties === false) {
        errors.push({
          path: place,
          rule: `is not a known key; known are ${Object.keys(properties).slice(0, 20).join(', ')}`,
        });
      } else if (isObject(schema.additionalProperties)) {
        errors.push(...this.value(inside, schema.additionalProperties, file, place));
      }
    }
    // The only dependency in these schemas: pieces stand in place of f and g.
    if (isObject(schema.dependencies) && Object.hasOwn(value, 'pieces')) {
      for (const key of ['f', 'g']) {
        if (Object.hasOwn(value, key)) {
          errors.push({path: [...path, key], rule: 'is given as well as pieces, which hold f and g; keep one of them'});
        }
      }
    }
  }

  private number(value: number, schema: JsonObject, path: Path, errors: FieldError[]): void {
    const {minimum, maximum, exclusiveMinimum} = schema;
    const refuse = (rule: string) => errors.push({path, rule: `is ${value}; must be ${rule}`});
    if (typeof minimum === 'number' && value < minimum) refuse(`at least ${minimum}`);
    if (typeof maximum === 'number' && value > maximum) refuse(`at most ${maximum}`);
    if (typeof exclusiveMinimum === 'number' && value <= exclusiveMinimum) refuse(`above ${exclusiveMinimum}`);
  }

  private oneOf(value: Json, forms: JsonObject[], file: string, path: Path): FieldError[] {
    let nearest: FieldError[] | null = null;
    for (const form of forms) {
      const errors = this.value(value, form, file, path);
      if (errors.length === 0) return [];
      if (nearest === null || depthOf(errors) >= depthOf(nearest)) nearest = errors;
    }
    if (nearest === null || depthOf(nearest) > path.length) return nearest ?? [];
    const missing = nearest[0].rule.startsWith('has no') && isObject(value);
    return [missing ? nearest[0] : {path, rule: `is ${describe(value)}; must be ${this.formsText(forms, file)}`}];
  }

  private formsText(forms: JsonObject[], file: string): string {
    const texts = new Set(forms.map((form) => this.formText(form, file)));
    return [...texts].filter((text) => text !== '').join(', or ');
  }

  private formText(form: JsonObject, file: string): string {
    if (typeof form.description === 'string') return form.description;
    if (typeof form.$ref === 'string') {
      const [other, pointer] = form.$ref.split('#');
      let target: Json = this.files[other === '' ? file : other];
      for (const step of pointer.split('/').slice(1)) target = (target as JsonObject)[step];
      const inner = target as JsonObject;
      if (typeof inner.description === 'string') return inner.description;
      if (Array.isArray(inner.oneOf)) return this.formText(inner.oneOf[0] as JsonObject, other === '' ? file : other);
      if (inner.type === 'array') return 'a list of numbers';
    }
    return typeof form.type === 'string' ? article(form.type) : '';
  }
}

function isA(value: Json, type: string): boolean {
  switch (type) {
    case 'array':
      return Array.isArray(value);
    case 'object':
      return isObject(value);
    case 'integer':
      return Number.isInteger(value);
    case 'null':
      return value === null;
    default:
      return typeof value === type;
  }
}

function wanted(schema: JsonObject, types: string[]): string {
  if (types.length === 1) return article(types[0]);
  return typeof schema.description === 'string' ? schema.description : types.map(article).join(' or ');
}

function article(type: string): string {
  const words: {[type: string]: string} = {
    array: 'a list',
    object: 'an object',
    integer: 'a whole number',
    number: 'a number',
    string: 'text in double quotes',
  };
  return words[type] ?? type;
}

function depthOf(errors: FieldError[]): number {
  return Math.max(...errors.map((error) => error.path.length));
}
