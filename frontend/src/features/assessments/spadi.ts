import type { Schemas } from "../../lib/api/client";

export type Answers = (number | null)[];

/** A subscale with more unanswered items has no score. */
const MAX_UNANSWERED = 2;

/** Calculate the score during input. The service calculates the stored score in the same way. */
export function spadiScore(items: Schemas["SpadiItem"][], answers: Answers): Schemas["SpadiScore"] {
  const subscaleScore = (subscale: Schemas["SpadiItem"]["subscale"]) => {
    const subscaleAnswers = answers.filter((_, index) => items[index]?.subscale === subscale);
    const answered = subscaleAnswers.filter((answer) => answer !== null);
    if (subscaleAnswers.length - answered.length > MAX_UNANSWERED) return null;
    return (10 * answered.reduce((sum, answer) => sum + answer, 0)) / answered.length;
  };
  const pain = subscaleScore("pain");
  const disability = subscaleScore("disability");
  return { pain, disability, total: pain === null || disability === null ? null : (pain + disability) / 2 };
}
