import { Text } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import type { Schemas } from "../../lib/api/client";
import { changeAsShown, formatChange, formatDayOf, formatMeasured, formatSide } from "../../lib/format";
import { t } from "../../lib/i18n";
import { ASSESSMENT_FORM } from "../../lib/patientQueries";
import { PageLink } from "../../ui/links";
import { spadiMeaning } from "../assessments/spadiMeaning";
import classes from "./home.module.css";

/** Shows the change of a patient since the assessment before, and what it means. */
export function ChangeLine({ change }: { change: Schemas["PatientChange"] }) {
  const { before, now, measure } = change;
  const difference = changeAsShown(before, now);
  const meaning = useMeaning(measure, difference);
  const words = difference === 0 ? t("home:unchanged") : formatChange(difference);
  return (
    <li className={classes.line ?? ""}>
      <div>
        <PageLink to="/patients/$patientId" params={{ patientId: change.patient.id }}>
          {change.patient.name}
        </PageLink>
        <Text size="sm">
          {[t(`home:${measure}`), formatSide(change.side), formatDayOf(change.assessed_at)].join(" · ")}
        </Text>
      </div>
      <div className={classes.change ?? ""}>
        <Text size="sm" fw={600}>
          {t(`home:change.${measure}`, {
            before: formatMeasured(before),
            now: formatMeasured(now),
            words,
          })}
        </Text>
        {meaning && <Text size="sm">{meaning}</Text>}
      </div>
    </li>
  );
}

/**
 * Return what a change means, or null if it is none. A change of the SPADI is judged as on the patient's page. For pain,
 * only the direction is said, because it has no verified limit.
 */
function useMeaning(measure: Schemas["PatientChange"]["measure"], difference: number): string | null {
  const form = useQuery(ASSESSMENT_FORM).data;
  if (difference === 0) return null;
  if (measure === "pain") return t(difference < 0 ? "home:meaning.lessPain" : "home:meaning.morePain");
  return form ? t(`home:meaning.${spadiMeaning(difference, form)}`) : null;
}
