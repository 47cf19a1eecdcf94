import type { Schemas } from "../../lib/api/client";

export type Answers = (number | null)[];

/** Maximum number of unanswered items. With more there is no score. */
const MAX_UNANSWERED = 2;

/** Calculate the score during input. The service calculates the stored score in the same way. */
export function spadiScore(items: Schemas["SpadiItem"][], answers: Answers): Schemas["SpadiScore"] {
  const unanswered = answers.filter((answer) => answer === null).length;
  if (unanswered > MAX_UNANSWERED) return { pain: null, disability: null, total: null };
  const subscaleScore = (subscale: Schemas["SpadiItem"]["subscale"]) => {
    const answered = answers
      .filter((_, index) => items[index]?.subscale === subscale)
      .filter((answer) => answer !== null);
    return (10 * answered.reduce((sum, answer) => sum + answer, 0)) / answered.length;
  };
  const pain = subscaleScore("pain");
  const disability = subscaleScore("disability");
  return { pain, disability, total: (pain + disability) / 2 };
}
