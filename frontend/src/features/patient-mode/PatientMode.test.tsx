import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { cleanup, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import type { Schemas } from "../../lib/api/client";
import { Questions } from "./PatientMode";

const QUESTIONNAIRE: Schemas["PatientQuestionnaire"] = {
  title: "Invented questions",
  side: "right",
  language: "en",
  copyright: "Nobody",
  questions: [{ text: "Does it hurt?", options: [{ answer: 0, label: "No" }] }],
  answers: [null],
  finished: false,
};

afterEach(cleanup);

it("a question names the shoulder that is meant", () => {
  render(
    <MantineProvider env="test">
      <QueryClientProvider client={new QueryClient()}>
        <Questions questionnaire={QUESTIONNAIRE} />
      </QueryClientProvider>
    </MantineProvider>,
  );
  expect(screen.getByRole("heading", { name: "Does it hurt?" })).toBeTruthy();
  expect(screen.getByText("Your right shoulder")).toBeTruthy();
});
