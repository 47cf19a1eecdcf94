import type { Schemas } from "../../lib/api/client";

export type Answers = (number | null)[];

/** With more than so many items of a half left out it has no score. */
const MOST_UNANSWERED = 2;

/** The score while it is being keyed in; what is kept is worked out by the service, in the same way. */
export function spadiScore(items: Schemas["SpadiItem"][], answers: Answers): Schemas["SpadiScore"] {
  const half = (subscale: Schemas["SpadiItem"]["subscale"]) => {
    const asked = answers.filter((_, place) => items[place]?.subscale === subscale);
    const answered = asked.filter((answer) => answer !== null);
    if (asked.length - answered.length > MOST_UNANSWERED) return null;
    return (10 * answered.reduce((sum, answer) => sum + answer, 0)) / answered.length;
  };
  const pain = half("pain");
  const disability = half("disability");
  return { pain, disability, total: pain === null || disability === null ? null : (pain + disability) / 2 };
}
