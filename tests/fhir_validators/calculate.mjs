// Calculates the read-only items of questionnaires by Medplum's FHIRPath.
//
// `node calculate.mjs < CASES` where CASES is a list of {questionnaire, response}; prints a list of {linkId: value or null}.
import { readFileSync } from "node:fs";
import { evalFhirPath } from "@medplum/core";

const SDC = "http://hl7.org/fhir/uv/sdc/StructureDefinition/sdc-questionnaire-calculatedExpression";

function calculated({ questionnaire, response }) {
  const resource = { type: "QuestionnaireResponse", value: response };
  const values = questionnaire.item
    .filter((item) => item.readOnly)
    .map((item) => {
      const { expression } = item.extension.find(({ url }) => url === SDC).valueExpression;
      return [item.linkId, evalFhirPath(expression, response, { "%resource": resource })[0] ?? null];
    });
  return Object.fromEntries(values);
}

console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(calculated)));
