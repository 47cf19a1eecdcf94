import type { Schemas } from "../../lib/api/client";
import { dayOf } from "../../lib/days";
import { t } from "../../lib/i18n";
import { describeSpan } from "./figuresSearch";

type Row = Schemas["PatientAdherence"];

/** Return the days, the sessions and the programmes in words, on the home page and above the list. */
export const describeAdherence = (adherence: Schemas["ProgrammeAdherence"]) =>
  t("statistics:figures.adherenceSummary", {
    days: describeSpan({ from: adherence.first_day, to: adherence.last_day }),
    held: adherence.held,
    count: adherence.prescribed,
    overdue: adherence.overdue,
    programmes: adherence.programmes,
  });

/**
 * Return the sums over all rows, as on the home page: a session more than was prescribed makes up for none of another
 * patient, and a programme is overdue if its next session was due before `today`.
 */
export const sumsOf = (rows: Pick<Row, "held" | "prescribed" | "due_at">[], today: string) => ({
  programmes: rows.length,
  overdue: rows.filter(({ due_at }) => dayOf(new Date(due_at)) < today).length,
  prescribed: rows.reduce((sum, { prescribed }) => sum + prescribed, 0),
  held: rows.reduce((sum, { held, prescribed }) => sum + Math.min(held, prescribed), 0),
});
