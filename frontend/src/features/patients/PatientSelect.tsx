import { Select } from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Patient } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";

const label = ({ name, clinic_number }: Patient) =>
  t("patients:choice.nameAndNumber", { name, number: clinic_number });

/** Query the first patients that match; an empty text matches all. */
export function useMatchingPatients(words: string) {
  return useQuery({
    queryKey: ["patients", words, false, "first"],
    queryFn: () => api.patients(words, false),
    placeholderData: keepPreviousData,
  });
}

/** A search field for all patients. */
export function PatientSelect(props: {
  chosen: Patient | undefined;
  onChange: (patientId: string | null) => void;
}) {
  const { chosen } = props;
  const [search, setSearch] = useState("");
  const [words] = useDebouncedValue(search, 200);
  // The label of the chosen patient is not a search text.
  const query = chosen && words === label(chosen) ? "" : words;
  const matches = useMatchingPatients(query);
  const items = matches.data?.items ?? [];
  const all = chosen && !items.some((patient) => patient.id === chosen.id) ? [...items, chosen] : items;
  return (
    <>
      <Select
        size="md"
        aria-label={t("patients:choice.label")}
        placeholder={all.length || words ? t("patients:choice.question") : t("patients:choice.none")}
        searchable
        // The service has already filtered, including by kana and numbers that the label does not show.
        filter={({ options }) => options}
        nothingFoundMessage={t("patients:choice.noMatch")}
        data={all.map((patient) => ({ value: patient.id, label: label(patient) }))}
        value={chosen?.id ?? null}
        onSearchChange={setSearch}
        onChange={props.onChange}
      />
      <ProblemNote error={matches.error} />
    </>
  );
}
